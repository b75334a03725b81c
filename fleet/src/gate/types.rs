//! Checks and their outcomes.

use serde::Serialize;

/// What a check is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// An effect that the common parameters do not have, or the residual.
    Physics,
    /// A parameter of a joint.
    Parameter,
    /// Sample rate, jitter, or delay of a connection.
    Rate,
    /// Gains of a loop.
    Gain,
    /// A sensor: noise, step, or a problem of the recording.
    Sensor,
    /// The stability of a loop.
    Stability,
}

/// Whether a change matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// No change beyond the bound.
    Passed,
    /// A change beyond the bound.
    Failed,
    /// The old recordings determine it to within the bound, and the new ones do not.
    Uncertain,
    /// The old recordings do not determine it to within the bound, so that it cannot be judged.
    NotJudged,
}

/// One check: a quantity of a joint, old and new.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// What it is about.
    pub kind: Kind,
    /// The joint, `recording` or `loop`.
    pub place: String,
    /// The quantity.
    pub quantity: String,
    /// Value of the old recordings; null where they have none.
    pub old: Option<f64>,
    /// Value of the new recordings.
    pub new: Option<f64>,
    /// Standard error of the difference, in the same unit.
    pub sd: Option<f64>,
    /// The bound of the difference, in the same unit.
    pub bound: Option<f64>,
    /// Whether it matters.
    pub outcome: Outcome,
    /// In a sentence.
    pub sentence: String,
}

/// All checks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gated {
    /// The checks, those that failed first.
    pub checks: Vec<Check>,
    /// What to know besides.
    pub notes: Vec<String>,
}

impl Gated {
    /// Checks with an outcome.
    pub fn with(&self, outcome: Outcome) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(move |check| check.outcome == outcome)
    }
}
