//! What an answer consists of.

use super::warning::Warning;
use super::witness::Witness;
use super::word::{Method, Word};
use crate::coupling::Coupling;
use crate::energy::EnergyAnswer;
use crate::frequency::{Frequency, FrequencyAnswer, FrequencyError};
use crate::moving::Decay;
use crate::nyquist::CoupledLoops;
use crate::outcome::Outcome;
use crate::part_check::PartCheck;
use crate::resimulate::edge::Edge;
use crate::resimulate::grips::GripEdge;
use crate::resimulate::over_cancelling::OverCancelling;
use crate::resimulate::{Gain, ResimulateError};
use crate::sensors::SensorFault;
use crate::session::Session;
use crate::transparency::Transparency;
use crate::unjudged::Unjudged;
use backdrive_control::margins::Margins;
use backdrive_nodes::build::BuildError;
use serde::Serialize;

/// A contradiction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Apart {
    /// A model does not do what was recorded.
    Model,
    /// Two answers differ.
    Methods,
}

/// Two results that contradict each other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Disagreement {
    /// Which.
    pub kind: Apart,
    /// In a sentence.
    pub text: String,
}

/// The loop that was measured beside the loop that the models make of the same session.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LoopCheck {
    /// RMS of the relative difference over the lines near the stability limit.
    pub difference: f64,
    /// What the noise of both explains of it.
    pub noise: f64,
    /// Whether they agree.
    pub agrees: bool,
}

/// The re-simulation's part of the answer.
#[derive(Debug, Clone)]
pub struct Resimulated {
    /// What happened at the gain asked.
    pub outcome: Outcome,
    /// Its signals.
    pub signals: Session,
    /// Where it stops being stable.
    pub edge: Edge,
    /// The same for other grips.
    pub grips: Vec<GripEdge>,
    /// Whether the canceller subtracts too much at rest.
    pub over_cancelling: Option<OverCancelling>,
    /// Energy at the gain asked.
    pub energy: EnergyAnswer,
    /// What the hand does.
    pub script: String,
}

/// The answer.
#[derive(Debug, Clone)]
pub struct Answer {
    /// The bag.
    pub bag: String,
    /// The gains asked about.
    pub gain: Gain,
    /// mu*lambda at which it was recorded: lowest and highest.
    pub recorded_gain: Option<[f64; 2]>,
    /// The verdict.
    pub verdict: Word,
    /// Why, in a sentence or two.
    pub reason: String,
    /// Which answer leads.
    pub from: Method,
    /// The lowest mu*lambda at which it is not stable; `None` where there is none in the range, or it is not known.
    pub critical_gain: Option<f64>,
    /// Where there is none: it is at least this.
    pub at_least: Option<f64>,
    /// Where a clamp or the travel ends the stable range before any oscillation does: from this mu*lambda on.
    pub limited_from: Option<f64>,
    /// 95 % interval; an open upper end is `None`.
    pub critical_gain_ci95: Option<(f64, Option<f64>)>,
    /// Frequency at the stability limit, Hz; 0 for a run-away without oscillation.
    pub critical_frequency_hz: Option<f64>,
    /// Margins at the gain asked, by the measured frequency response.
    pub margins: Option<Margins>,
    /// The frequency response's answer at the gain.
    pub frequency_answer: Option<FrequencyAnswer>,
    /// The frequency response.
    pub frequency: Option<Frequency>,
    /// The re-simulation.
    pub resimulated: Option<Resimulated>,
    /// Why there is none.
    pub no_resimulation: Option<String>,
    /// What the recording itself did at its own gain.
    pub recorded_outcome: Option<Outcome>,
    /// Energy as recorded.
    pub recorded_energy: EnergyAnswer,
    /// Transparency as recorded, per axis.
    pub transparency: Vec<Transparency>,
    /// How well each device's model predicts the device.
    pub checks: Vec<PartCheck>,
    /// How well the models predict the loop.
    pub loop_check: Option<LoopCheck>,
    /// Where answers and models part.
    pub disagreements: Vec<Disagreement>,
    /// What a reader has to know.
    pub warnings: Vec<Warning>,
    /// What to record for a better answer.
    pub advice: Option<String>,
    /// What in the recording keeps a green answer back; `None` where nothing does, or the answer was not green.
    pub held_back: Option<Unjudged>,
    /// Everything that counted, the method that leads first.
    pub witnesses: Vec<Witness>,
    /// Whose stability limit and frequency the headline has.
    pub decided_by: Option<String>,
    /// What couples the motors of each axis whose motors were both recorded; empty where none was.
    pub coupled: Vec<CoupledAxis>,
    /// The loops of several axes together, by the models, or why they give no answer; `None` of one axis, and where there are no models.
    pub loops: Option<Result<CoupledLoops, String>>,
    /// Signals that say nothing, or not always.
    pub sensors: Vec<SensorFault>,
}

/// An axis with the force of a motor at either side.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoupledAxis {
    /// Name of the axis.
    pub axis: String,
    /// The law of either motor; `None` where it cannot be identified.
    pub coupling: Option<Coupling>,
    /// Why it cannot.
    pub why_not: Option<String>,
    /// The mode of the pair that dies most slowly; `None` where none oscillates, or none can be seen.
    pub slowest_mode: Option<Decay>,
    /// What the pair did.
    pub outcome: Outcome,
    /// Largest force of the environment on the slave, N or N m.
    pub largest_contact: f64,
}

/// Why there is no answer at all.
#[derive(Debug, thiserror::Error)]
pub enum AnswerError {
    /// Of the session.
    #[error(transparent)]
    Frequency(#[from] FrequencyError),
    /// Of the re-simulation.
    #[error(transparent)]
    Resimulate(#[from] ResimulateError),
    /// Of a device.
    #[error(transparent)]
    Build(#[from] BuildError),
}
