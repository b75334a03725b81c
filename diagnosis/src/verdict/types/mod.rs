//! The verdict file as a value: the result of a diagnosis, in SI units. Reading takes files of earlier versions, which lack newer keys.

mod arm;
mod finding;
mod next_experiment;
mod place;
mod servo;
mod shown;

pub use arm::{ArmJoint, ArmPart, BaseParameter};
pub use finding::{Alternative, Detectable, Estimate, Estimates, Finding, Interval, Moved, Parameter};
pub use next_experiment::{NextExperiment, Planned, PlannedPayload, Refused, Sensor};
pub use servo::{ServoAnswer, ServoErrors, ServoPart, SharedCause};
pub use shown::Where;

use crate::audit::{self, Weight};
use crate::output_error::error_budget::BudgetedError;
use crate::recordings::unknown::Estimated;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of the verdict file that is written. It changes when a key changes its meaning, not when one is added.
pub const SCHEMA: u32 = 1;

/// The result of a diagnosis: one JSON file. All values are in SI units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Verdict {
    /// Version of the format, 1. It changes when a key changes its meaning, not when one is added.
    pub schema: u32,
    /// The verdict in one word.
    #[serde(rename = "verdict")]
    pub word: Word,
    /// The verdict in one sentence.
    #[serde(default)]
    pub sentence: String,
    /// The physics that was left out, most important first. With `unexplained` the nearest explanation, which is not claimed.
    #[serde(default)]
    pub findings: Vec<Finding>,
    /// When, at which frequencies and in which state the refitted nominal model and the recordings part; null where nothing was compared.
    #[serde(rename = "where")]
    pub shows: Option<Where>,
    /// The nominal model's parameters that the fit moved, by their path in the model (`bodies.drum`, `elements.cable.stiffness`,
    /// `inputs.feedback_force.gain`; of a list with the index, `elements.slip.force[0]`). Empty where the nominal file is kept.
    #[serde(default)]
    pub parameters: BTreeMap<String, Moved>,
    /// The residual of the claimed explanation; null where nothing was held against anything.
    pub remaining: Option<Remaining>,
    /// What is off in a prediction although no physics is missing, by source and output; an effect whose whole benefit is no larger is not claimed.
    #[serde(default)]
    pub error_budget: Vec<BudgetedError>,
    /// Errors on the held-out recordings; of a set that holds none out, on the fitted ones.
    #[serde(default)]
    pub held_out: HeldOut,
    /// What the recordings say of themselves before any physics: clock, sensors, units, loops. What matters most comes first.
    #[serde(default)]
    pub audit: Vec<Remark>,
    /// What was found of the inputs that nobody measured.
    #[serde(default)]
    pub unknown_inputs: Vec<Estimated>,
    /// File of the diagnosed model, beside the verdict; of a kept model a copy of the nominal one.
    #[serde(default)]
    pub model_after: String,
    /// Files of models of other explanations whose residual is little larger, beside the verdict, the nearest first.
    #[serde(default)]
    pub rival_models: Vec<String>,
    /// What to record next: it separates rivals, confirms the findings, or determines uncertain parameters; or the reason why no recording would help.
    /// Null in files of versions that planned one for `ambiguous` and `cannot_tell` only.
    pub next_experiment: Option<NextExperiment>,
    /// Where nothing was added to the model: for each physics the smallest size that the recordings would have shown, at the place where it
    /// shows best. Otherwise null.
    pub detectable: Option<Vec<Detectable>>,
    /// How far the search went; null in files of versions that did not say.
    #[serde(default)]
    pub searched: Option<Searched>,
    /// Additional results of the diagnosis of an arm; not in other files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arm: Option<Box<ArmPart>>,
    /// Additional results of a diagnosis from commands and positions; not in other files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub servo: Option<Box<ServoPart>>,
}

/// How far a search went. It computes the same on every machine, unless it is cut short.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Searched {
    /// Steps of simulations, those of a linear network being the unit.
    pub steps: u64,
    /// Whether its effort ended before everything was tried that was wanted.
    pub exhausted: bool,
    /// Whether it was interrupted, or ended by the clock: on another machine the verdict may be another one.
    pub cut_short: bool,
}

/// A verdict in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Word {
    /// Physics was left out, and `findings` names it.
    Missing,
    /// Nothing is missing, but the model's parameters are off; `model_after` has the better ones.
    Parameters,
    /// The model explains the recordings down to the sensors' noise.
    NothingMissing,
    /// An effect is missing and no known effect explains it; `where` still states where it appears.
    Unexplained,
    /// Two or more explanations fit equally well, and `next_experiment` separates them in simulation; `findings[0].alternatives` lists them.
    Ambiguous,
    /// The excitation is not sufficient for an answer, and `next_experiment` is sufficient; or explanations of different kind or place fit equally well,
    /// no experiment within the range of the recordings separates them, and it states why.
    CannotTell,
}

impl Word {
    /// As the file has it, such as `nothing_missing`.
    pub fn name(self) -> &'static str {
        match self {
            Word::Missing => "missing",
            Word::Parameters => "parameters",
            Word::NothingMissing => "nothing_missing",
            Word::Unexplained => "unexplained",
            Word::Ambiguous => "ambiguous",
            Word::CannotTell => "cannot_tell",
        }
    }

    /// For a reader, such as `nothing missing`.
    pub fn spoken(self) -> String {
        self.name().replace('_', " ")
    }

    /// Whether the findings are claimed: that physics is missing, whichever of some it is.
    pub fn claims(self) -> bool {
        match self {
            Word::Missing | Word::Ambiguous => true,
            Word::Parameters | Word::NothingMissing | Word::Unexplained | Word::CannotTell => false,
        }
    }

    /// Whether the model's structure is right: nothing is missing, its parameters may be off.
    pub fn is_structure_right(self) -> bool {
        match self {
            Word::Parameters | Word::NothingMissing => true,
            Word::Missing | Word::Unexplained | Word::Ambiguous | Word::CannotTell => false,
        }
    }
}

/// The residual of the claimed explanation: a statement of its own, which does not take the claim back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Remaining {
    /// Share of the residual of the refitted nominal model on held-out recordings, at least 0; null where that is nothing.
    pub share: Option<f64>,
    /// What the sensors' noise alone would be of that residual, at least 0.
    pub floor_share: Option<f64>,
    /// Residual on the fitted recordings, in standard deviations of the sensor noise: 1 cannot be reduced further.
    pub noise_sd: Option<f64>,
    /// What the device does not repeat where it was repeated (recordings of one excitation, periods), in standard deviations of the sensor noise, the
    /// largest of the outputs: no model can do better. Null where nothing was repeated.
    #[serde(default)]
    pub not_repeated: Option<f64>,
    /// Where it shows; null where it is the sensors' noise.
    #[serde(rename = "where")]
    pub shows: Option<Where>,
    /// The effect that would take most of it, in words, such as `backlash between motor and drum`; null where none would.
    pub looks_like: Option<String>,
}

/// Errors on held-out recordings. `nrmse` is the root mean square of the error over the standard deviation of the measured signal,
/// averaged over all pairs of recording and output. Null where a model cannot be simulated.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeldOut {
    /// Of the nominal model as given.
    pub nrmse_before: Option<f64>,
    /// Of the nominal structure with its parameters refitted.
    pub nrmse_refit: Option<f64>,
    /// Of the diagnosed model.
    pub nrmse_after: Option<f64>,
    /// What the sensors' noise alone would leave.
    pub noise_floor: Option<f64>,
    /// The same of the nominal model as given, by output: the root of the summed squared errors over that of the summed squared deviations
    /// from each recording's mean, all recordings together.
    pub pooled_before: Option<BTreeMap<String, f64>>,
    /// As `pooled_before`, of the nominal structure with its parameters refitted.
    pub pooled_refit: Option<BTreeMap<String, f64>>,
    /// As `pooled_before`, of the diagnosed model.
    pub pooled_after: Option<BTreeMap<String, f64>>,
    /// As `pooled_before`, of the sensors' noise alone.
    pub pooled_floor: Option<BTreeMap<String, f64>>,
    /// Every pair of recording and output by itself.
    #[serde(default)]
    pub per_record: Vec<RecordErrors>,
}

/// Errors at one output in one recording, over the standard deviation of the measured signal. Null where a model cannot be simulated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecordErrors {
    /// The recording's file, without its folder.
    pub record: String,
    /// The output.
    pub output: String,
    /// Of the nominal model as given.
    pub nrmse_before: Option<f64>,
    /// Of the nominal structure with its parameters refitted.
    pub nrmse_refit: Option<f64>,
    /// Of the diagnosed model.
    pub nrmse_after: Option<f64>,
    /// What the sensors' noise alone would leave.
    pub noise_floor: Option<f64>,
}

/// What was seen in the recordings before any physics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Remark {
    /// What was looked at: `clock`, `gaps`, `short`, `missing`, `constant`, `outliers`, `encoder`, `filtered`, `saturated`, `sign`, `unit`, `loop`,
    /// `repeats`, `noise`, `timing`, `hold`, `thinned`, `velocity`, `band`, `same_force`.
    pub what: String,
    /// Recordings, signal, or both.
    #[serde(rename = "where")]
    pub place: String,
    /// What was seen, in one clause.
    pub message: String,
    /// How much it matters.
    pub weight: Weight,
}

impl From<&audit::Remark> for Remark {
    fn from(seen: &audit::Remark) -> Remark {
        Remark { what: seen.about.to_string(), place: seen.place(), message: seen.text.clone(), weight: seen.weight }
    }
}

#[cfg(test)]
mod tests;
