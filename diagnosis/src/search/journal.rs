//! What a search did, step by step, so that it can be followed.

use crate::output_error::work::Steps;

/// A step of a search, as it went.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// What it does.
    pub step: &'static str,
    /// What became of it.
    pub outcome: Outcome,
    /// What is the best after it, such as `coulomb@drum-ground`; empty for the nominal model.
    pub best: String,
    /// Residual of that, root mean square, noise standard deviations.
    pub residual: f64,
}

/// What became of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// So many structures were proposed and so many fitted as far as they were worth it, with so much work.
    Taken {
        /// Structures proposed that were not tried before.
        proposed: usize,
        /// Structures fitted on all recordings.
        fitted: usize,
        /// Steps of simulations.
        work: Steps,
    },
    /// The best leaves white noise: nothing is left to explain.
    ResidualIsWhite,
    /// The work was used up.
    NoWorkLeft,
    /// It has nothing new to propose.
    NothingNew,
}
