//! Why there is no window.

/// Why there is no window: one sentence.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// The run, the graph or the bag is not what is needed.
    #[error("{0}")]
    Input(String),
    /// This machine does not let it.
    #[error("{0}")]
    Machine(String),
}

impl LiveError {
    pub(crate) fn input(message: impl std::fmt::Display) -> LiveError {
        LiveError::Input(message.to_string())
    }

    pub(crate) fn machine(message: impl std::fmt::Display) -> LiveError {
        LiveError::Machine(message.to_string())
    }
}
