//! Options of `backdrive replay`.

use super::changes::Changes;
use super::run_result::RunResult;
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Example:
  backdrive replay contact.mcap --mu 1 --lambda 0.6 --bag again.mcap

Exit codes: 0 stable, or no loop to judge; 1 not stable; 7 not known, such as for a bag that was cut off.";

/// `backdrive replay`
#[derive(Debug, Args)]
pub struct Replay {
    /// The bag of a run.
    pub recording: PathBuf,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub result: RunResult,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub changes: Changes,
}
