//! Why logs of an arm cannot be diagnosed.

use backdrive_plant::recording::RecordingError;
use backdrive_plant::tomlfile::FileError;

/// Why logs of an arm cannot be diagnosed: one sentence, with file and key where there is one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ArmError {
    /// A model, a set or a log cannot be read.
    #[error("{0}")]
    File(#[from] FileError),
    /// A log holds what no recording can.
    #[error("{0}")]
    Recording(#[from] RecordingError),
    /// A bag cannot be read, or lacks a topic or a field.
    #[error("{0}")]
    Bag(String),
    /// The model has no robot.
    #[error("{0}: has no [robot], so it is not an arm; a model of one axis is diagnosed from recordings of its inputs and outputs")]
    NoRobot(String),
    /// The robot cannot be computed.
    #[error("{0}")]
    Robot(String),
    /// A log lacks what is needed, or is of no use.
    #[error("{log}: {message}")]
    Log {
        /// The file.
        log: String,
        /// What is wrong, and what to do.
        message: String,
    },
    /// There is nothing to fit.
    #[error("no log is named for fitting; name some in set.toml under fit")]
    NoLogs,
    /// The model cannot be simulated.
    #[error("the diagnosed model cannot be simulated: {0}")]
    Simulation(String),
    /// The verdict cannot be written.
    #[error("{0}")]
    Written(String),
}
