//! Why a run does not begin, or gives nothing.

use crate::done::Fault;
use backdrive_bags::BagError;
use backdrive_launch::LaunchError;
use backdrive_launch::asked::AskedError;
use backdrive_nodes::build::BuildError;
use backdrive_plant::tomlfile::FileError;
use backdrive_sets::SetError;
use backdrive_stability::summary::SummaryError;
use std::fmt::Display;

/// Why a run does not begin, or gives nothing: one sentence.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A file is missing, broken, or does not hold what is needed.
    #[error("{0}")]
    Input(String),
    /// This machine does not let it.
    #[error("{0}")]
    Machine(String),
    /// A bag cannot be written.
    #[error("{0}")]
    Bag(BagError),
    /// The nodes cannot be supervised.
    #[error("{0}")]
    Launch(#[from] LaunchError),
    /// The run of an experiment did not go as it should.
    #[error("{message}")]
    Experiment {
        /// What went wrong.
        fault: Fault,
        /// File, experiment and cause.
        message: String,
    },
}

impl RunError {
    pub(crate) fn input(message: impl Display) -> RunError {
        RunError::Input(message.to_string())
    }

    pub(crate) fn machine(message: impl Display) -> RunError {
        RunError::Machine(message.to_string())
    }
}

impl From<FileError> for RunError {
    fn from(error: FileError) -> RunError {
        RunError::input(error)
    }
}

impl From<SummaryError> for RunError {
    fn from(error: SummaryError) -> RunError {
        RunError::input(error)
    }
}

impl From<BuildError> for RunError {
    fn from(error: BuildError) -> RunError {
        RunError::input(error)
    }
}

impl From<SetError> for RunError {
    fn from(error: SetError) -> RunError {
        RunError::input(error)
    }
}

impl From<AskedError> for RunError {
    fn from(error: AskedError) -> RunError {
        RunError::input(error)
    }
}
