//! Why a proof cannot be done.

use backdrive_plant::tomlfile::FileError;
use std::fmt::Display;
use std::path::Path;

/// Why a proof cannot be done.
#[derive(Debug, thiserror::Error)]
pub enum ProveError {
    /// A file is missing or wrong, or a run or a search cannot be done with it.
    #[error("{0}")]
    Input(String),
    /// This machine does not let it: a file cannot be written, a program not started.
    #[error("{0}")]
    Machine(String),
}

impl ProveError {
    /// A file is wrong, or what it asks for cannot be done.
    pub fn input(message: impl Display) -> ProveError {
        ProveError::Input(message.to_string())
    }

    /// This machine does not let it.
    pub fn machine(message: impl Display) -> ProveError {
        ProveError::Machine(message.to_string())
    }

    /// A file cannot be written.
    pub fn write(path: &Path, error: std::io::Error) -> ProveError {
        ProveError::machine(format!("{}: cannot be written: {error}", path.display()))
    }
}

impl From<FileError> for ProveError {
    fn from(error: FileError) -> ProveError {
        ProveError::input(error)
    }
}
