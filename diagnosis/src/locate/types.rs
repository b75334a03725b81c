//! What a location is asked with, and what it finds.

use super::character::Character;
use super::law::Law;
use super::period::Ripple;
use crate::hypothesis::Place;
use backdrive_plant::model::Model;
use backdrive_plant::stepper::CompileError;
use serde::{Serialize, Serializer};

/// A recording, as columns.
#[derive(Debug, Clone)]
pub struct Run<'a> {
    /// For messages and reports.
    pub name: &'a str,
    /// Sample time, s.
    pub period: f64,
    /// Samples of each input of the model.
    pub inputs: &'a [Vec<f64>],
    /// Samples of each output of the model; `None` where it was not recorded.
    pub outputs: Vec<Option<&'a [f64]>>,
    /// The model with the parameters that differ in this run; `None` where none do.
    pub model: Option<&'a Model>,
}

impl<'a> From<&'a crate::recordings::problem::Record> for Run<'a> {
    fn from(record: &'a crate::recordings::problem::Record) -> Run<'a> {
        let outputs = record.outputs.iter().map(|column| column.as_deref()).collect();
        Run { name: &record.name, period: record.period, inputs: &record.inputs, outputs, model: None }
    }
}

/// How much is tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Laws of each form and place that are put to the test of the recordings.
    pub laws_of_a_form: usize,
    /// Places, best first, at which the force may jump at reversals.
    pub jumps_at: usize,
    /// Iterations for nonlinear elements of the nominal model.
    pub iterations: usize,
    /// Samples of all runs together, at most: of longer ones every second, third, ... is taken.
    pub most_samples: usize,
    /// The only place to look at; all places where there is none.
    pub only: Option<Place>,
    /// Whether filters are tuned on the run with the largest residual alone.
    pub tuned_on_one: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options { laws_of_a_form: 2, jumps_at: 4, iterations: 2, most_samples: usize::MAX, only: None, tuned_on_one: false }
    }
}

impl Options {
    /// Fast rather than accurate: a set of any length in a second or two.
    pub fn quick() -> Options {
        Options { laws_of_a_form: 1, jumps_at: 0, iterations: 1, most_samples: 30_000, only: None, tuned_on_one: true }
    }
}

/// Why nothing can be located.
#[derive(Debug, thiserror::Error)]
pub enum LocateError {
    /// The model cannot be simulated.
    #[error("the model cannot be simulated: {0}")]
    Model(#[from] CompileError),
    /// Columns are missing.
    #[error("{run}: has columns for {inputs} inputs and {outputs} outputs, fewer than the model")]
    Columns {
        /// The recording.
        run: String,
        /// Input columns.
        inputs: usize,
        /// Output columns.
        outputs: usize,
    },
    /// No smoother has anything to do.
    #[error("{run}: has {samples} samples; at least 16 are needed to locate a force")]
    TooShort {
        /// The recording.
        run: String,
        /// Samples.
        samples: usize,
    },
    /// The model left all bounds.
    #[error("{run}: the model's motion diverges; refit it first")]
    Diverged {
        /// The recording.
        run: String,
    },
    /// None of the outputs was recorded.
    #[error("{run}: none of the model's outputs was recorded")]
    NothingMeasured {
        /// The recording.
        run: String,
    },
    /// There is nothing to look at.
    #[error("there are no recordings to locate anything in")]
    NoRuns,
    /// A noise level is wrong.
    #[error("there are {found} noise levels, the model has {expected} outputs; each must be a finite number, at least 0")]
    Noise {
        /// Levels.
        found: usize,
        /// Outputs.
        expected: usize,
    },
    /// The linear part of the model has no finite equations.
    #[error(
        "the equations of the model's linear part are singular; a body has no inertia, or parameters differ by too many orders of \
        magnitude"
    )]
    Singular,
}

/// The force at a place over one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Course {
    /// The run.
    pub run: String,
    /// Sample time, s.
    pub period: f64,
    /// Force as that of an element there, N or N m; the error in the signal's unit at a motion input or an output.
    pub force: Vec<f64>,
    /// Its standard deviation.
    pub deviation: Vec<f64>,
    /// Displacement and velocity across the place, deviation included; empty at an output.
    pub displacement: Vec<f64>,
    /// m/s.
    pub velocity: Vec<f64>,
}

/// The force that a place would need, and the laws that it may follow.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// Where.
    #[serde(serialize_with = "shown")]
    pub place: Place,
    /// Log-likelihood of the recordings with any force here.
    pub log_likelihood: f64,
    /// What a jump of the force at reversals adds to it; `None` where that was not tried.
    pub jump_gain: Option<f64>,
    /// Log-likelihood with the force that follows the best law, less the penalty for its parameters: what places are ranked by.
    pub evidence: f64,
    /// Root of the force's mean square.
    pub rms: f64,
    /// Root of its mean variance.
    pub deviation: f64,
    /// Laws, best first: by evidence where it was computed, then by what they explain on other parts of the recordings.
    pub laws: Vec<Law>,
    /// The strongest ripples over displacement, strongest first.
    pub ripples: Vec<Ripple>,
    /// Odd or even, memory, rate, energy; `None` at an output.
    pub character: Option<Character>,
    /// The force itself, one course for each run.
    pub courses: Vec<Course>,
}

/// Places that no sensor separates: a force of the same course at one or the other gives the same readings within the noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Class {
    /// Indices into [`Location::ranking`], best first.
    pub members: Vec<usize>,
}

/// When, at which frequencies and in which state the residual shows, as `where` of a verdict has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Where {
    /// Spans with most of the power of the residual, s; empty where it is everywhere.
    pub time: Vec<[f64; 2]>,
    /// Band with nine tenths of its power, Hz.
    pub band_hz: [f64; 2],
    /// In words.
    pub state: String,
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Location {
    /// Log-likelihood of the recordings where nothing is missing.
    pub log_likelihood_without: f64,
    /// Normalised residual of the nominal model: root of the mean square over samples and outputs, in noise standard deviations.
    pub mismatch: f64,
    /// Places, best first.
    pub ranking: Vec<Candidate>,
    /// Classes of places that cannot be separated; every place is in one.
    pub classes: Vec<Class>,
    /// When and in which state.
    pub shows: Where,
}

fn shown<S: Serializer>(place: &Place, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(place)
}
