//! Options of `backdrive check` and `backdrive graph`.

use clap::Args;
use std::path::PathBuf;

/// Example and exit codes.
pub const CHECK_HELP: &str = "Example:
  backdrive check launch/contact.toml

Exit codes: 0 fine, 2 usage, 3 the graph or a file that it names is wrong.";

/// Example and exit codes.
pub const DRAW_HELP: &str = "Example:
  backdrive graph launch/contact.toml

Exit codes: 0 drawn, 2 usage, 3 the graph is wrong, 5 standard output cannot be written.";

/// `backdrive check`, `backdrive graph`
#[derive(Debug, Args)]
pub struct Graph {
    /// The graph file.
    pub graph: PathBuf,
}
