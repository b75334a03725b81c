//! A plant that cannot be made, and a step that cannot.

use crate::truth::TruthError;

/// A plant that cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum PlantError {
    /// The truth does not fit the model.
    #[error(transparent)]
    Truth(#[from] TruthError),
    /// The sampling period is not a time.
    #[error("the sampling period is {0} s; give a time above 0")]
    Period(f64),
    /// Bodies or elements between them have no inertia.
    #[error("device \"{0}\": a body moves freely without inertia; give it some, or an inerter")]
    NoInertia(String),
    /// A dead time would fill the memory.
    #[error("signal \"{signal}\" is delayed by {delay_s} s, more than {most} sampling periods; shorten it")]
    Delay {
        /// Name of the input or output.
        signal: String,
        /// s.
        delay_s: f64,
        /// Sampling periods.
        most: usize,
    },
    /// The substep would be too short.
    #[error(
        "device \"{device}\" moves at up to {rad_per_s:.0} rad/s, which a period of {period_s} s cannot be divided for; \
         soften its springs, add inertia or sample faster"
    )]
    TooStiff {
        /// Its name.
        device: String,
        /// Bound of its fastest motion.
        rad_per_s: f64,
        /// The sampling period.
        period_s: f64,
    },
}

/// A step that cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StepError {
    /// Too few or too many inputs.
    #[error("{found} inputs were given, the device has {expected}")]
    Inputs {
        /// How many were given.
        found: usize,
        /// How many there are.
        expected: usize,
    },
    /// An input is not a number.
    #[error("input {0} is not a finite number; hold the last one or send 0")]
    NotFinite(usize),
    /// The device ran away beyond all numbers.
    #[error("the device ran away; the inputs or the loop around it are not stable")]
    RanAway,
}
