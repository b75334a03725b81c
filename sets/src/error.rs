//! What is wrong with a set.

use backdrive_plant::recording::RecordingError;
use backdrive_plant::tomlfile::FileError;
use std::fmt::Display;

/// What is wrong with a set or its recordings, and what to do: a sentence.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SetError(String);

impl SetError {
    /// With its sentence.
    pub(crate) fn new(sentence: impl Display) -> SetError {
        SetError(sentence.to_string())
    }
}

impl From<FileError> for SetError {
    fn from(error: FileError) -> SetError {
        SetError::new(error)
    }
}

impl From<RecordingError> for SetError {
    fn from(error: RecordingError) -> SetError {
        SetError::new(error)
    }
}
