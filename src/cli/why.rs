//! Options of `backdrive why`.

use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive run launch/contact.toml --lambda 6 --canceller none --bag shaking.mcap
  backdrive why shaking.mcap
  backdrive why shaking.mcap --html out/why.html
  backdrive why shaking.mcap --out out/as-recorded.toml
  backdrive why session/ --roles roles.toml

Exit codes: 0 nothing shakes, 1 it does, 2 usage, 3 the bag is wrong, 5 the page cannot be written, 7 it cannot be told, 130 interrupted.";

/// `backdrive why`
#[derive(Debug, Args)]
pub struct Why {
    /// The bag of a run; with --roles somebody else's recording.
    pub recording: PathBuf,
    /// Which topic is which, for a recording that we did not make: docs/roles-example.toml. Then the signals alone are asked, and no loop is run again.
    #[arg(long, value_name = "FILE")]
    pub roles: Option<PathBuf>,
    /// Write the answer as one HTML file that opens offline.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Where the master is not what the graph says: write it as it was, with its grip, as a model file that drives a canceller.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Print the answer as JSON.
    #[arg(long)]
    pub json: bool,
}
