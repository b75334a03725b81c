//! Why nothing is carried or played.

use crate::LaunchError;
use std::fmt::Display;

/// Why a bridge carries nothing, or a bag is not played: one sentence.
#[derive(Debug, thiserror::Error)]
pub enum CarryError {
    /// The run, the graph or the bag is not what is needed.
    #[error("{0}")]
    Input(String),
    /// This machine or its network does not let it.
    #[error("{0}")]
    Machine(String),
    /// The directory of the run cannot be used.
    #[error("{0}")]
    Launch(#[from] LaunchError),
}

impl CarryError {
    pub(crate) fn input(message: impl Display) -> CarryError {
        CarryError::Input(message.to_string())
    }

    pub(crate) fn machine(message: impl Display) -> CarryError {
        CarryError::Machine(message.to_string())
    }
}
