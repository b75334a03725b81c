//! Why a fleet cannot be judged.

use std::fmt::Display;
use std::path::Path;

/// Why a fleet cannot be judged: one sentence, with the file and what to do.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// A manifest, a recording, a model or an option is wrong.
    #[error("{0}")]
    Input(String),
    /// This machine cannot read or write a file.
    #[error("{0}")]
    Machine(String),
    /// The caller stopped the work.
    #[error("stopped; what was done until then is kept, and the same command continues")]
    Stopped,
}

impl FleetError {
    /// Something that was given is wrong.
    pub fn input(why: impl Display) -> FleetError {
        FleetError::Input(why.to_string())
    }

    /// A file cannot be read or written.
    pub fn file(path: &Path, why: impl Display) -> FleetError {
        FleetError::Machine(format!("{}: {why}", path.display()))
    }
}
