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

Exit codes: 0 no oscillation, 1 oscillation, 2 usage, 3 the bag is wrong, 5 the page cannot be written, 7 not known, 130 interrupted.";

/// `backdrive why`
#[derive(Debug, Args)]
pub struct Why {
    /// The bag of a run; with --roles any other recording.
    pub recording: PathBuf,
    /// The roles of topics, for a recording that backdrive did not make (docs/roles-example.toml). Then only the signals are used, without re-simulation.
    #[arg(long, value_name = "FILE")]
    pub roles: Option<PathBuf>,
    /// Write the answer as one HTML file that opens offline.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// If the master differs from the graph: write it as found, with its grip, as a model file for a canceller. If only the slave differs: write that.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Print the answer as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `backdrive why-now`
#[derive(Debug, Args)]
pub struct WhyNow {
    /// The bag of a run that still lasts.
    pub recording: PathBuf,
    /// What was seen of the oscillation, as JSON.
    #[arg(long, value_name = "JSON")]
    pub seen: String,
}
