//! Options of `backdrive secret`.

use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Example:
  backdrive secret run.secret

Exit codes: 0 made, 2 usage, 3 the file exists or cannot be written.";

/// `backdrive secret`
#[derive(Debug, Args)]
pub struct Secret {
    /// The file to create, readable only by its owner.
    pub file: PathBuf,
}
