//! An experiment that was chosen, or why there is none.

use crate::tuning::tuning;

/// An experiment that was not made yet.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// The input that it drives.
    pub input: String,
    /// What to play, and what would be seen.
    pub sentence: String,
    /// The excitation file.
    pub text: String,
    /// The excitation on one line, as command lines and graphs have it.
    pub excitation: String,
    /// The structures that it separates, or the parameters that it determines.
    pub between: Vec<String>,
    /// Standard deviations between the two of them that it separates least, each refitted to it.
    pub separation: f64,
    /// Root mean square of that difference over all samples, noise standard deviations. For [`super::excite`] that of one standard deviation of the
    /// parameter.
    pub level: f64,
    /// The output in which most of it shows.
    pub output: String,
    /// A sensor that has to be added for it; `None` where those there are do.
    pub sensor: Option<NewSensor>,
    /// How often it has to be played for `experiment.wanted` standard deviations.
    pub repeats: u32,
    /// Length of one playing, s.
    pub duration: f64,
    /// Sampling rate that it was planned for, Hz.
    pub rate_hz: f64,
}

/// A sensor that the device does not have.
#[derive(Debug, Clone, PartialEq)]
pub struct NewSensor {
    /// Its kind, as an output of a model has it: `position`, `velocity`, `force`.
    pub kind: String,
    /// The body that it is on; `None` for a force.
    pub of: Option<String>,
    /// The element whose force it reads; `None` for a motion.
    pub element: Option<String>,
    /// The noise that it may have at most for the experiment to tell as much as is said, standard deviation, SI unit.
    pub noise_sd: f64,
}

/// Why there is no experiment, in one sentence that names a way to improve.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Reason(pub String);

/// How often an experiment is played for `experiment.wanted` standard deviations.
pub(super) fn repeats(separation: f64) -> u32 {
    ((tuning().experiment.wanted / separation).powi(2).ceil() as u32).clamp(1, tuning().experiment.most_repeats as u32)
}
