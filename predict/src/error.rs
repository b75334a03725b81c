//! Why a model is not simulated or refitted.

use backdrive_plant::recording::RecordingError;
use backdrive_plant::tomlfile::FileError;
use backdrive_servo::error::ServoError;
use backdrive_sets::SetError;
use std::fmt::Display;

/// Why a model is not simulated or refitted: one sentence.
#[derive(Debug, thiserror::Error)]
pub enum PredictError {
    /// A file or a recording is wrong, or does not suit the model.
    #[error("{0}")]
    Input(String),
    /// An option has a value that it cannot have.
    #[error("{0}")]
    Usage(String),
}

impl PredictError {
    pub(crate) fn input(message: impl Display) -> PredictError {
        PredictError::Input(message.to_string())
    }
}

impl From<FileError> for PredictError {
    fn from(error: FileError) -> PredictError {
        PredictError::input(error)
    }
}

impl From<RecordingError> for PredictError {
    fn from(error: RecordingError) -> PredictError {
        PredictError::input(error)
    }
}

impl From<SetError> for PredictError {
    fn from(error: SetError) -> PredictError {
        PredictError::input(error)
    }
}

impl From<ServoError> for PredictError {
    fn from(error: ServoError) -> PredictError {
        PredictError::input(error)
    }
}
