//! Why there is no answer.

use std::fmt::Display;

/// Why there is no answer: one sentence.
#[derive(Debug, thiserror::Error)]
pub enum AnswerError {
    /// A file or a recording is wrong, or does not suit the model.
    #[error("{0}")]
    Input(String),
    /// An option has a value that it cannot have for this device.
    #[error("{0}")]
    Usage(String),
}

impl AnswerError {
    pub(crate) fn input(message: impl Display) -> AnswerError {
        AnswerError::Input(message.to_string())
    }
}
