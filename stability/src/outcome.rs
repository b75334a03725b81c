//! What a run did: stable, a limit cycle, unstable, limited, or nothing that can be judged. Also the signals of one axis, from which
//! [`crate::judgement::judge`] decides which.

use crate::unjudged::{Gaps, Unjudged};
use backdrive_plant::model::Motion;
use serde::Serialize;

/// In what an axis' positions are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub enum Unit {
    /// m: the axis slides.
    #[default]
    #[serde(rename = "m")]
    Metre,
    /// rad: the axis turns.
    #[serde(rename = "rad")]
    Radian,
    /// m or rad: the recording does not state which.
    #[serde(rename = "m or rad")]
    Unknown,
}

impl Unit {
    /// Of a device's axes.
    pub fn of(motion: Motion) -> Unit {
        match motion {
            Motion::Translation => Unit::Metre,
            Motion::Rotation => Unit::Radian,
        }
    }

    /// The unit of a position.
    pub fn symbol(self) -> &'static str {
        match self {
            Unit::Metre => "m",
            Unit::Radian => "rad",
            Unit::Unknown => "(m or rad)",
        }
    }

    /// A length or an angle for a person: mm of an axis that slides.
    pub fn text(self, value: f64) -> String {
        match self {
            Unit::Metre => format!("{:.3} mm", 1e3 * value),
            Unit::Radian if value.abs() < 0.01 => format!("{:.3} mrad", 1e3 * value),
            Unit::Radian => format!("{value:.3} rad"),
            Unit::Unknown => format!("{} (m or rad)", significant(value)),
        }
    }
}

/// Three digits.
fn significant(value: f64) -> String {
    let digits = if value == 0.0 { 0 } else { (2 - value.abs().log10().floor() as i32).clamp(0, 9) };
    format!("{value:.*}", digits as usize)
}

/// What closes the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Closes {
    /// The force that comes back is that of what the slave touches: without contact the loop is open.
    #[default]
    InContact,
    /// The law reflects motion too, so the loop is closed in free motion as well.
    Always,
}

/// One axis of a run, one value per step.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Time of one step, s.
    pub period_s: f64,
    /// The hand's intended motion, m or rad; empty where it was not recorded.
    pub intent: Vec<f64>,
    /// The master's measured position, m or rad.
    pub position: Vec<f64>,
    /// Force of the environment on the slave, N or N m.
    pub contact: Vec<f64>,
    /// The slave's position, m or rad; empty where it was not recorded.
    pub slave: Vec<f64>,
    /// Position scale, master to slave.
    pub mu: f64,
    /// What closes the loop.
    pub closes: Closes,
    /// In what positions are counted.
    pub unit: Unit,
    /// Force applied to the master, N or N m.
    pub feedback: Vec<f64>,
    /// What was added to that force on purpose, N or N m; empty where nothing was.
    pub dither: Vec<f64>,
    /// Whether a clamp acted.
    pub clamped: Vec<bool>,
    /// The device's limits of motion, m or rad.
    pub travel: Option<[f64; 2]>,
    /// Step of the position sensor, m or rad; 0 for an ideal one.
    pub resolution: f64,
    /// Standard deviation of that sensor's noise, m or rad.
    pub noise: f64,
    /// What is missing.
    pub gaps: Gaps,
}

/// The verdict on a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub enum Outcome {
    /// What oscillates dies.
    Stable,
    /// It oscillates on and neither grows nor dies.
    LimitCycle {
        /// Half the peak-to-peak of the master's position, m or rad; of the slave's by mu where that moves more and the forces alone show it.
        amplitude_m: f64,
        /// Hz.
        frequency_hz: f64,
        /// Unit of the amplitude.
        unit: Unit,
    },
    /// It grows.
    Unstable {
        /// Exponential growth of the envelope, 1/s.
        growth_per_s: f64,
    },
    /// A clamp acted for more than 1 % of the contact, or the hand left the device's travel: never called stable.
    Limited {
        /// Share of the steps in contact in which a clamp acted.
        clamped_share: f64,
        /// Whether the master left its travel.
        beyond_travel: bool,
    },
    /// There was nothing to judge, or not enough of it: neither stable nor not.
    #[serde(rename = "cannot_tell")]
    NotJudged {
        /// Why.
        #[serde(flatten)]
        why: Unjudged,
    },
}

impl Outcome {
    /// The word for scripts.
    pub fn word(&self) -> &'static str {
        match self {
            Outcome::Stable => "stable",
            Outcome::LimitCycle { .. } => "limit_cycle",
            Outcome::Unstable { .. } => "unstable",
            Outcome::Limited { .. } => "limited",
            Outcome::NotJudged { .. } => "cannot_tell",
        }
    }

    /// Whether it was seen to be stable: what was not judged is not.
    pub fn is_stable(&self) -> bool {
        *self == Outcome::Stable
    }

    /// Whether it oscillated or ran away.
    pub fn is_unstable(&self) -> bool {
        matches!(self, Outcome::LimitCycle { .. } | Outcome::Unstable { .. })
    }

    /// The same, but not judged instead of stable where something prevents the answer "stable". What speaks against the loop stands.
    pub fn held_back(self, by: Option<Unjudged>) -> Outcome {
        match (self, by) {
            (Outcome::Stable, Some(why)) => Outcome::NotJudged { why },
            // A loss is more informative than that nothing was touched in the rest.
            (Outcome::NotJudged { why: before }, Some(why)) if !before.is_loss() && why.is_loss() => Outcome::NotJudged { why },
            (outcome, _) => outcome,
        }
    }

    /// How bad it is, for several axes: the worst counts. An axis that touched nothing is no evidence on one that did, but one with missing data
    /// prevents the answer "stable" for all.
    pub(crate) fn rank(&self) -> u8 {
        match self {
            // Of several that say nothing, the one that came farther.
            Outcome::NotJudged { why: Unjudged::NoContact | Unjudged::NoFeedback } => 0,
            Outcome::NotJudged { why } if !why.is_loss() => 1,
            Outcome::Stable => 2,
            Outcome::NotJudged { .. } => 3,
            Outcome::Limited { .. } => 4,
            Outcome::LimitCycle { .. } => 5,
            Outcome::Unstable { .. } => 6,
        }
    }

    /// The worst of several axes.
    pub fn worst(outcomes: impl IntoIterator<Item = Outcome>) -> Option<Outcome> {
        outcomes.into_iter().max_by_key(Outcome::rank)
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Outcome::Stable => write!(f, "stable"),
            Outcome::LimitCycle { amplitude_m, frequency_hz, unit } => {
                write!(f, "limit cycle of ±{} at {frequency_hz:.1} Hz", unit.text(*amplitude_m))
            }
            Outcome::Unstable { growth_per_s } => write!(f, "unstable, grows by {growth_per_s:.2} per second"),
            Outcome::Limited { clamped_share, beyond_travel } => {
                let travel = if *beyond_travel { "; the master left its travel" } else { "" };
                write!(f, "limited: a clamp acted in {:.1} % of the contact{travel}", clamped_share * 100.0)
            }
            Outcome::NotJudged { why } => write!(f, "stability not known: {why}"),
        }
    }
}

/// An oscillation below this is not felt and not counted, m or rad.
pub(crate) const LEAST_AMPLITUDE: f64 = 2e-6;

/// Half the span of thousands of samples of noise stays below this, standard deviations.
pub(crate) const NOISE: f64 = 5.0;

/// Slower than this the hand moves too: where its intent was not recorded, only faster motion is the loop's, Hz.
pub(crate) const LOWEST_HZ: f64 = 8.0;
