//! Why no model and set can be made.

use backdrive_bags::BagError;
use backdrive_plant::recording::RecordingError;
use backdrive_plant::tomlfile::FileError;
use std::fmt::Display;
use std::path::Path;

/// Why no model and set can be made.
#[derive(Debug, thiserror::Error)]
pub enum InitError {
    /// An answer is missing, or makes no sense beside the others.
    #[error("{0}")]
    Usage(String),
    /// A recording or a folder is not there, or wrong.
    #[error("{0}")]
    Input(String),
    /// A file cannot be written, or the terminal not be read.
    #[error("{0}")]
    Machine(String),
    /// A table cannot be made a bag.
    #[error(transparent)]
    Bag(BagError),
}

impl InitError {
    /// A recording or a folder is wrong.
    pub(crate) fn input(message: impl Display) -> InitError {
        InitError::Input(message.to_string())
    }

    /// A file cannot be written.
    pub(crate) fn write(path: &Path, error: std::io::Error) -> InitError {
        InitError::Machine(format!("{}: cannot be written: {error}", path.display()))
    }
}

impl From<FileError> for InitError {
    fn from(error: FileError) -> InitError {
        InitError::input(error)
    }
}

impl From<RecordingError> for InitError {
    fn from(error: RecordingError) -> InitError {
        InitError::input(error)
    }
}
