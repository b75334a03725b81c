//! Options of `backdrive why`.

use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive run launch/contact.toml --lambda 6 --canceller none
  backdrive why contact.mcap
  backdrive why contact.mcap --html out/why.html

Exit codes: 0 nothing shakes, 1 it does, 2 usage, 3 the bag is wrong, 5 the page cannot be written, 7 it cannot be told, 130 interrupted.";

/// `backdrive why`
#[derive(Debug, Args)]
pub struct Why {
    /// The bag of a run.
    pub recording: PathBuf,
    /// Write the answer as one HTML file that opens offline.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print the answer as JSON.
    #[arg(long)]
    pub json: bool,
}
