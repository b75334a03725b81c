//! Why an excitation cannot be had.

/// Why an excitation cannot be had.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExcitationError {
    /// The text is no excitation.
    #[error("excitation \"{text}\": {message}")]
    Text {
        /// What was written.
        text: String,
        /// What is wrong in it.
        message: String,
    },
    /// The sampling rate cannot carry it.
    #[error("a sampling rate of {rate} Hz cannot carry {highest} Hz; it needs more than {needed} Hz")]
    Rate {
        /// Hz.
        rate: String,
        /// Hz.
        highest: String,
        /// Hz.
        needed: String,
    },
    /// An experiment does not go with a model.
    #[error("experiment \"{experiment}\": {message}")]
    Experiment {
        /// Its name.
        experiment: String,
        /// What is wrong.
        message: String,
    },
    /// Too many samples to hold.
    #[error("{seconds} s at {rate} Hz are more than {most} samples")]
    TooLong {
        /// s.
        seconds: String,
        /// Hz.
        rate: String,
        /// Samples.
        most: usize,
    },
}
