//! What a search found, and why one cannot start.

use super::journal::Entry;
use crate::equation_error::OnForces;
use crate::hypothesis::Place;
use crate::output_error::candidate::Candidate;
use crate::output_error::error_budget::BudgetedError;
use crate::output_error::hold::HoldEvidence;
use crate::output_error::work::Steps;

/// A hypothesis that was tried alone.
#[derive(Debug, Clone)]
pub struct Tried {
    /// Its id.
    pub id: String,
    /// Share of the misfit that screening promised.
    pub promised: f64,
    /// Share that a refit took, where there was one.
    pub taken: Option<f64>,
}

/// The smallest size of an effect that the recordings would have shown.
#[derive(Debug, Clone)]
pub struct Detectable {
    /// Its name.
    pub physics: &'static str,
    /// Where.
    pub place: Place,
    /// The parameter that gives its size.
    pub key: String,
    /// Its size.
    pub size: f64,
    /// Unit of that.
    pub unit: String,
}

/// What a search found.
#[derive(Debug)]
pub struct Search {
    /// Errors in the predictions of the refitted nominal model although no effect is missing.
    pub errors: Vec<BudgetedError>,
    /// The evidence of the refitted nominal model on inputs that are held by default.
    pub holds: Vec<HoldEvidence>,
    /// Standard deviation of each output's measuring error, in its unit.
    pub noise_sd: Vec<f64>,
    /// Level of each output with the parameters as given, noise standard deviations.
    pub levels_given: Vec<f64>,
    /// The nominal model refitted.
    pub nominal: Candidate,
    /// Structures with something added, each fitted to its end, best first.
    pub found: Vec<Candidate>,
    /// Hypotheses tried alone.
    pub tried: Vec<Tried>,
    /// How many hypotheses there were.
    pub hypotheses: usize,
    /// Number of residuals.
    pub samples: usize,
    /// Number of residuals of the held-out recordings.
    pub unseen_samples: usize,
    /// What would have been seen with the refitted nominal model, each effect at the place where it shows best.
    pub detectable: Vec<Detectable>,
    /// Simulations of a recording.
    pub simulations: u64,
    /// Steps of simulations, of the model with its elements taken together: what it computed.
    pub work: Steps,
    /// Whether its effort ended before everything was tried.
    pub exhausted: bool,
    /// What it did, step by step.
    pub journal: Vec<Entry>,
    /// Whether it was interrupted, or the time on the clock ended it.
    pub cut: bool,
    /// What laws on forces along a measured motion say; `None` where force and motion are not both known.
    pub forces: Option<OnForces>,
}

impl Search {
    /// What counts as noise, in words.
    pub fn noise(&self) -> &'static str {
        self.forces.as_ref().map_or("the sensor noise", OnForces::noise)
    }
}

/// Why a search cannot start.
#[derive(Debug, thiserror::Error)]
pub enum SearchError {
    /// The nominal model's motion leaves all bounds on the recordings.
    #[error("the nominal model diverges on the recordings: check units, signs and sample time of the inputs")]
    RunsAway,
    /// The refitted nominal model cannot be simulated.
    #[error("the refitted nominal model cannot be simulated: {0}")]
    Compile(#[from] backdrive_plant::stepper::CompileError),
}
