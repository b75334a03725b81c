//! Options of `backdrive bridge`.

use super::network::Network;
use clap::Args;

/// Examples and exit codes.
pub const HELP: &str = "Example:
  backdrive run launch/contact.toml --clock realtime &
  backdrive bridge --domain 7

Exit codes: 0 ran until the run ended, 2 usage, 3 no run is alive or several are, 4 messages were lost, 5 prevented by the network, or a foreign sender on the run's topics.";

/// `backdrive bridge`
#[derive(Debug, Args)]
pub struct Bridge {
    /// The beginning of the run's name; not needed if only one run is active.
    pub run: Option<String>,
    /// Also receive the topics of the graph's nodes on other hosts, for a run with --host. Without this the bridge only publishes.
    #[arg(long)]
    pub both_ways: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub network: Network,
    /// Print the message counts as JSON.
    #[arg(long)]
    pub json: bool,
}
