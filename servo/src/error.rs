//! Why commands and positions cannot be diagnosed.

use backdrive_bags::BagError;
use backdrive_plant::recording::RecordingError;
use backdrive_plant::tomlfile::FileError;

/// Why commands and positions cannot be diagnosed: one sentence, with file and key where there is one.
#[derive(Debug, thiserror::Error)]
pub enum ServoError {
    /// A model, a set or a table cannot be read.
    #[error("{0}")]
    File(#[from] FileError),
    /// A table holds what no recording can.
    #[error("{0}")]
    Recording(#[from] RecordingError),
    /// A bag cannot be read, or lacks a topic or a field.
    #[error("{0}")]
    Bag(#[from] BagError),
    /// The robot cannot be computed.
    #[error("{0}")]
    Robot(String),
    /// A recording or the set lacks what is needed, or is of no use.
    #[error("{at}: {message}")]
    Wrong {
        /// The file, and the signal where there is one.
        at: String,
        /// What is wrong, and what to do.
        message: String,
    },
}

impl ServoError {
    pub(crate) fn wrong(at: impl Into<String>, message: impl Into<String>) -> ServoError {
        ServoError::Wrong { at: at.into(), message: message.into() }
    }
}
