//! Options of `backdrive bridge`.

use super::network::Network;
use clap::Args;

/// Examples and exit codes.
pub const HELP: &str = "Example:
  backdrive run launch/contact.toml --clock realtime &
  backdrive bridge --domain 7

Exit codes: 0 carried until the run ended, 2 usage, 3 no run is alive or several are, 4 messages were lost, 5 the network does not let it, or a stranger sends on the run's topics.";

/// `backdrive bridge`
#[derive(Debug, Args)]
pub struct Bridge {
    /// The beginning of the run's name; not needed while one run is alive.
    pub run: Option<String>,
    /// Also take what the graph's nodes on other hosts send, for a run with --host; without it the bridge only publishes.
    #[arg(long)]
    pub both_ways: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub network: Network,
    /// Print what crossed as JSON.
    #[arg(long)]
    pub json: bool,
}
