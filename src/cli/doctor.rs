//! Options of `backdrive doctor`.

use super::network::Network;
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Example:
  backdrive doctor --interface eth0
  backdrive doctor --device arm.toml

Exit codes: 0 runs work here, 2 usage, 3 no such interface, 5 a check failed.";

/// `backdrive doctor`
#[derive(Debug, Args)]
pub struct Doctor {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub network: Network,
    /// How long to listen for other hosts, s; ROS programs announce themselves every 10 to 30 s.
    #[arg(long = "listen", value_name = "S", default_value_t = 3.0)]
    pub listen_s: f64,
    /// Check this device too, from its file, and measure its bus: true rate, round trip, retries. No motor is turned on.
    #[arg(long, value_name = "FILE")]
    pub device: Option<PathBuf>,
    /// Print the findings as JSON.
    #[arg(long)]
    pub json: bool,
}
