//! Options of `backdrive replay`.

use super::changes::Changes;
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Example:
  backdrive replay contact.mcap --mu 1 --lambda 0.6 --bag again.mcap

Exit codes: 0 stable, or no loop to judge; 1 not stable; 7 it cannot be told, as of a bag that was cut short.";

/// `backdrive replay`
#[derive(Debug, Args)]
pub struct Replay {
    /// The bag of a run.
    pub recording: PathBuf,
    /// Write a page about the run as one HTML file: what happened, signals, contact, timing, losses, events.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub changes: Changes,
}
