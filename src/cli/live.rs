//! Options of `backdrive live`.

use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive run launch/contact.toml --clock realtime --duration 60 &
  backdrive live
  backdrive live contact.mcap
  backdrive live contact.mcap contact-2.mcap

Exit codes: 0 the run has ended, or Ctrl-C; 2 usage; 3 no run is alive or several are, or a bag is wrong; 5 the page cannot be served.";

/// `backdrive live`
#[derive(Debug, Args)]
pub struct Live {
    /// A bag, or two to be shown over each other; or the beginning of the name of a run in progress, which is not needed if only one is active.
    pub what: Vec<PathBuf>,
    /// Where the page is served. Other machines reach it only at another address than this one's loopback.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:0")]
    pub address: SocketAddr,
    /// Greatest lambda that may be set from the page: by default 10 times that of the graph with a guard, and that of the graph without one.
    #[arg(long, value_name = "LAMBDA")]
    pub most_lambda: Option<f64>,
    /// Print the addresses of the page as JSON.
    #[arg(long)]
    pub json: bool,
}
