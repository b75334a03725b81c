//! What an analysis gives.

use super::change::Shape;
use super::observations::Covariate;
use super::pooled::Pooled;
use serde::Serialize;

/// What a table shows.
#[derive(Debug, Clone, Serialize)]
pub struct Analysis {
    /// Recordings of the table.
    pub recordings: usize,
    /// Units.
    pub units: usize,
    /// False discovery rate over all units, joints and parameters.
    pub false_discoveries: f64,
    /// Changes of single units, those of one unit and joint together, the clearest first.
    pub changes: Vec<Change>,
    /// Changes that the whole fleet shows together.
    pub together: Vec<Change>,
    /// Units that differ from the others.
    pub odd: Vec<Odd>,
    /// Parameters, by joint.
    pub parameters: Vec<OfFleet>,
    /// Recordings without an answer, or with a problem of their own; none of them is in the numbers.
    pub left_out: Vec<LeftOut>,
    /// What to know of the results.
    pub notes: Vec<String>,
}

/// A change of a parameter of a joint of a unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// The unit; `all units` of what the fleet shows together.
    pub unit: String,
    /// The joint.
    pub joint: String,
    /// The parameter's column.
    pub parameter: &'static str,
    /// At once, or rising.
    pub shape: Shape,
    /// Date of the first recording since the change.
    pub since: String,
    /// First and last date that is possible at 95 %.
    pub possible: [String; 2],
    /// Level before, SI units.
    pub before: f64,
    /// Change: of a step its height, of a ramp its height at the last recording.
    pub effect: f64,
    /// 95 % interval of the change.
    pub ci95: [f64; 2],
    /// Recordings since the change.
    pub recordings: usize,
    /// p-value of the change by itself.
    pub p: f64,
    /// The smallest false discovery rate at which it is a discovery.
    pub q: f64,
    /// In a sentence.
    pub sentence: String,
}

/// A unit that differs from the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Odd {
    /// The unit.
    pub unit: String,
    /// The joint.
    pub joint: String,
    /// The parameter's column.
    pub parameter: &'static str,
    /// Its value.
    pub value: f64,
    /// Median of the units.
    pub fleet: f64,
    /// 95 % interval of the difference.
    pub ci95: [f64; 2],
    /// The smallest false discovery rate at which it is a discovery.
    pub q: f64,
    /// In a sentence.
    pub sentence: String,
}

/// A parameter of a joint over the fleet.
#[derive(Debug, Clone, Serialize)]
pub struct OfFleet {
    /// The joint.
    pub joint: String,
    /// The parameter's column.
    pub parameter: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its dependence on temperature or warm-up, which was taken out.
    pub covariate: Option<Covariate>,
    /// Partially pooled; of a unit with a change only recordings since then.
    pub pooled: Pooled,
}

/// A recording that no number has.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// The recording.
    pub recording: String,
    /// Its unit.
    pub unit: String,
    /// Why.
    pub why: String,
}
