//! The verdict's word, and the method that it is from.

use crate::outcome::Outcome;
use serde::Serialize;

/// The verdict's word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Word {
    /// Stable.
    Stable,
    /// It oscillates and does not grow.
    LimitCycle,
    /// It grows.
    Unstable,
    /// A clamp or the travel decides, not the loop.
    Limited,
    /// The recording gives no answer.
    CannotTell,
}

impl Word {
    /// As in JSON.
    pub fn text(self) -> &'static str {
        match self {
            Word::Stable => "stable",
            Word::LimitCycle => "limit_cycle",
            Word::Unstable => "unstable",
            Word::Limited => "limited",
            Word::CannotTell => "cannot_tell",
        }
    }

    /// Of what a run did.
    pub fn of(outcome: &Outcome) -> Word {
        match outcome {
            Outcome::Stable => Word::Stable,
            Outcome::LimitCycle { .. } => Word::LimitCycle,
            Outcome::Unstable { .. } => Word::Unstable,
            Outcome::Limited { .. } => Word::Limited,
            Outcome::NotJudged { .. } => Word::CannotTell,
        }
    }
}

/// Which answer leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Re-simulation with the models in the bag.
    Resimulation,
    /// The measured frequency response.
    Frequency,
    /// The recording itself, at the gain asked.
    Recording,
    /// None.
    Nothing,
}
