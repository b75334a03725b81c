//! Physics at places: what was found, what could be instead, what would have been seen, and their parameters.

use super::place::PlaceInFile;
use crate::hypothesis::{Family, Place};
use crate::tuning::tuning;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// An effect that the model leaves out. It has `between` (two bodies, or a body and `ground`) or `signal` (an input or an output).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Finding {
    /// Its name: an element kind of model files, a key of an input or output (`delay`, `bandwidth`, `saturation`, `gain`, `back_emf`, `offset`),
    /// `inertia`, `gravity`, or `series_compliance`.
    pub physics: String,
    /// Where it acts.
    #[serde(flatten, with = "PlaceInFile")]
    pub place: Place,
    /// Its parameters by name, as model files call them.
    #[serde(default)]
    pub parameters: BTreeMap<String, Parameter>,
    /// Elements of the nominal model that it takes the place of.
    #[serde(default)]
    pub replaces: Vec<String>,
    /// How sure it is, 0 to 1, its rivals and what remains taken into account.
    #[serde(default)]
    pub confidence: f64,
    /// What kind of physics it is; not in files of others.
    #[serde(default)]
    pub family: Option<Family>,
    /// How sure it is that physics of this kind acts there, whatever its law, 0 to 1; at least `confidence`. 0 in files of others.
    #[serde(default)]
    pub family_confidence: f64,
    /// What could stand in its place, the likeliest first.
    #[serde(default)]
    pub alternatives: Vec<Alternative>,
    /// Of an arm that was simulated in closed loop: how much correction the loop adds with it, in times of what it adds without it. Above 1.05 it is not asserted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closed_loop: Option<f64>,
}

impl Finding {
    /// Whether it is claimed with confidence: its own confidence is at least that of a sure claim, and no alternative is as likely.
    pub fn is_sure(&self) -> bool {
        self.confidence >= tuning().claim.asserted && !self.has_likelier_rival()
    }

    /// Whether one of its alternatives is at least as likely as itself: then it is not asserted.
    pub fn has_likelier_rival(&self) -> bool {
        self.alternatives.iter().any(|rival| rival.confidence >= self.confidence)
    }
}

/// An alternative explanation of a finding. It has `between` or `signal`, as a finding.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Alternative {
    /// Its name, as that of a finding.
    pub physics: String,
    /// Where it acts.
    #[serde(flatten, with = "PlaceInFile")]
    pub place: Place,
    /// How likely it is, 0 to 1.
    #[serde(default)]
    pub confidence: f64,
}

/// 95 % interval, lower and upper end, in the unit of its number. An end is null where there is none.
pub type Interval = [Option<f64>; 2];

/// A parameter of a finding: a number, or a list of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Parameter {
    /// A number.
    One(Estimate),
    /// A list.
    List(Estimates),
}

/// A number with its 95 % interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Estimate {
    /// As fitted, in `unit`.
    pub value: f64,
    /// 95 % interval, in `unit`; one-sided where the value is at a bound of what the fit may try.
    pub ci95: Interval,
    /// Whether the value is at a bound of what the fit may try; not in other files.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub at_bound: bool,
    /// Unit; empty for a number without one.
    #[serde(default)]
    pub unit: String,
}

/// A list of parameters, each with its 95 % interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Estimates {
    /// As fitted, in `unit`.
    pub value: Vec<f64>,
    /// 95 % interval of each, in `unit`.
    pub ci95: Vec<Interval>,
    /// Unit of all; empty for parameters without one.
    #[serde(default)]
    pub unit: String,
}

/// A number of the nominal model as the fit has it, in the unit of the model file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Moved {
    /// As fitted.
    pub value: f64,
    /// 95 % interval.
    pub ci95: Interval,
    /// As the nominal file has it.
    pub nominal: f64,
    /// How far it moved, in its own standard deviations, on the scale of the fit (logarithmic for what cannot change its sign).
    pub moved_sd: Option<f64>,
}

/// The smallest size of an effect that the recordings would have shown. Besides `physics`, `between` or `signal` and `unit` it has one more key:
/// the parameter of the size of the effect, with its value in `unit`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Detectable {
    /// Its name, as that of a finding.
    pub physics: String,
    /// The place where it shows best.
    #[serde(flatten, with = "PlaceInFile")]
    pub place: Place,
    /// Unit of the size.
    #[serde(default)]
    pub unit: String,
    /// The size by the parameter's name, in `unit`.
    #[serde(flatten)]
    pub size: BTreeMap<String, f64>,
}
