//! Why there is nothing to diagnose.

use backdrive_bags::BagError;
use backdrive_plant::recording::RecordingError;
use backdrive_plant::stepper::CompileError;
use backdrive_plant::tomlfile::FileError;

/// Why there is nothing to diagnose.
#[derive(Debug, thiserror::Error)]
pub enum ProblemError {
    /// A file cannot be read, or has impossible content.
    #[error(transparent)]
    File(#[from] FileError),
    /// A bag cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// Samples are no recording of this model.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The nominal model cannot be simulated.
    #[error("the nominal model cannot be simulated: {0}")]
    Model(#[from] CompileError),
    /// A recording that is too short to be fitted.
    #[error("{name}: has {count} samples; a diagnosis needs at least {fewest} per recording")]
    Short {
        /// Its file.
        name: String,
        /// Samples that it has.
        count: usize,
        /// Samples that it needs.
        fewest: usize,
    },
    /// The set does not say which model, or names nothing to fit.
    #[error("{0}")]
    Set(String),
}
