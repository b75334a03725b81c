//! What happens in a recording, before any question of why.

use crate::stairs::of_session;
use backdrive_stability::judgement::frequency_hz;
use backdrive_stability::oscillation::oscillation;
use backdrive_stability::outcome::{Outcome, Trace, Unit};
use backdrive_stability::resimulate::Run;
use backdrive_stability::session::Session;
use backdrive_stability::unjudged::Unjudged;
use backdrive_stability::verdict::{recorded_outcome, recorded_traces};
use serde::Serialize;

/// Below this an oscillation is a wandering, not a vibration, Hz: the same as the verdict on a run has.
const LOWEST_HZ: f64 = 8.0;

/// What rings on for more periods than this before it has fallen to a third is ringing.
const RINGS: f64 = 3.0;

/// Time after a touch that is evaluated, s.
const AFTER_TOUCH_S: f64 = 0.5;

/// Ringing below this is not felt, m or rad.
const FELT: f64 = 10e-6;

/// A wandering that stands still for this share of its time goes in stairs.
const STANDS: f64 = 0.5;

/// What happens.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "happens", rename_all = "snake_case")]
pub enum Happening {
    /// What oscillates dies at once.
    Nothing,
    /// It rings after a touch, and dies.
    Ringing {
        /// Hz.
        frequency_hz: f64,
        /// Periods until it has fallen to a third (1/e).
        periods: f64,
    },
    /// It oscillates on.
    LimitCycle {
        /// Half the peak-to-peak of the master's position, m or rad.
        amplitude_m: f64,
        /// Hz.
        frequency_hz: f64,
        /// Unit of the amplitude.
        unit: Unit,
    },
    /// It grows.
    RunAway {
        /// Exponential growth, 1/s.
        growth_per_s: f64,
        /// Hz; 0 where it does not oscillate.
        frequency_hz: f64,
    },
    /// It creeps in steps: sticks, slips, sticks.
    Stairs {
        /// Half the peak-to-peak of the master's position, m or rad.
        amplitude_m: f64,
        /// Steps per second.
        frequency_hz: f64,
        /// Unit of the amplitude.
        unit: Unit,
    },
    /// The follower goes in stairs while its command moves evenly.
    FollowerStairs {
        /// Size of one step, m or rad.
        step: f64,
        /// Steps per second.
        frequency_hz: f64,
        /// Share of the time in which it stands while its command moves.
        stands: f64,
        /// Unit of the step.
        unit: Unit,
    },
    /// A clamp acts, or the device leaves its travel.
    Saturation {
        /// Share of the steps in contact in which a clamp acted.
        clamped_share: f64,
        /// Whether the master left its travel.
        beyond_travel: bool,
    },
    /// Nothing was judged.
    NotJudged {
        /// Why.
        #[serde(flatten)]
        why: Unjudged,
    },
}

impl Happening {
    /// Of a recording, whose first `rows` rows are within all bounds.
    pub fn of(session: &Session, rows: usize) -> Happening {
        let mut traces = recorded_traces(session);
        let outcome = recorded_outcome(session).unwrap_or(Outcome::NotJudged { why: Unjudged::Empty });
        for trace in &mut traces {
            trace.position.truncate(rows);
            trace.contact.truncate(rows);
        }
        // A follower that sticks and slips does so by itself, and needs no loop.
        let calm =
            matches!(outcome, Outcome::Stable | Outcome::NotJudged { why: Unjudged::NoContact | Unjudged::NoFeedback | Unjudged::NoHold });
        if (calm || session.is_one_way())
            && let Some((found, unit)) = of_session(session)
        {
            return Happening::FollowerStairs { step: found.step, frequency_hz: found.frequency_hz, stands: found.stands, unit };
        }
        // Whatever else kept it from being judged, it was no loop.
        if session.is_one_way() && matches!(outcome, Outcome::NotJudged { .. }) {
            return Happening::NotJudged { why: Unjudged::NoFeedback };
        }
        Happening::of_outcome(outcome, &traces)
    }

    /// Of a verdict and what it was drawn from.
    pub fn of_outcome(outcome: Outcome, traces: &[Trace]) -> Happening {
        let frequency = || traces.iter().map(frequency_hz).fold(0.0, f64::max);
        match outcome {
            Outcome::Stable => traces
                .iter()
                .filter_map(ringing)
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .map_or(Happening::Nothing, |(frequency_hz, periods)| Happening::Ringing { frequency_hz, periods }),
            Outcome::LimitCycle { amplitude_m, frequency_hz, unit } if frequency_hz < LOWEST_HZ && traces.iter().any(in_stairs) => {
                Happening::Stairs { amplitude_m, frequency_hz, unit }
            }
            Outcome::LimitCycle { amplitude_m, frequency_hz, unit } => Happening::LimitCycle { amplitude_m, frequency_hz, unit },
            Outcome::Unstable { growth_per_s } => Happening::RunAway { growth_per_s, frequency_hz: frequency() },
            Outcome::Limited { clamped_share, beyond_travel } => Happening::Saturation { clamped_share, beyond_travel },
            Outcome::NotJudged { why } => Happening::NotJudged { why },
        }
    }

    /// Of a loop that was re-simulated.
    pub fn of_run(run: &Run) -> Happening {
        let hz = run.frequency_hz.unwrap_or(0.0);
        match Happening::of_outcome(run.outcome, &[]) {
            Happening::RunAway { growth_per_s, .. } => Happening::RunAway { growth_per_s, frequency_hz: hz },
            other => other,
        }
    }

    /// Whether something undesired happens.
    pub fn is_trouble(&self) -> bool {
        !matches!(self, Happening::Nothing | Happening::NotJudged { .. })
    }

    /// Hz, where something oscillates.
    pub fn frequency_hz(&self) -> Option<f64> {
        match self {
            Happening::Ringing { frequency_hz, .. }
            | Happening::LimitCycle { frequency_hz, .. }
            | Happening::FollowerStairs { frequency_hz, .. }
            | Happening::Stairs { frequency_hz, .. } => Some(*frequency_hz),
            Happening::RunAway { frequency_hz, .. } => Some(*frequency_hz),
            _ => None,
        }
    }
}

impl std::fmt::Display for Happening {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Happening::Nothing => write!(f, "no oscillation: disturbances decay at once"),
            Happening::Ringing { frequency_hz, periods } => {
                write!(f, "it rings at {frequency_hz:.0} Hz after contact and needs {periods:.0} periods to decay to a third")
            }
            Happening::LimitCycle { amplitude_m, frequency_hz, unit } => {
                write!(f, "a limit cycle of ±{} at {frequency_hz:.1} Hz", unit.text(*amplitude_m))
            }
            Happening::RunAway { growth_per_s, frequency_hz } if *frequency_hz > 0.0 => {
                write!(f, "unstable: an oscillation at {frequency_hz:.1} Hz grows by {growth_per_s:.2} per second")
            }
            Happening::RunAway { growth_per_s, .. } => write!(
                f,
                "unstable: the motion diverges without oscillating, by {growth_per_s:.2} \
                per second"
            ),
            Happening::Stairs { amplitude_m, frequency_hz, unit } => {
                write!(f, "stick-slip of ±{}, {frequency_hz:.1} times a second", unit.text(*amplitude_m))
            }
            Happening::FollowerStairs { step, frequency_hz, stands, unit } => write!(
                f,
                "the follower goes in stairs of {}, {frequency_hz:.1} times a second, and stands for {:.0} % of the time while its command moves",
                unit.text(*step),
                100.0 * stands
            ),
            Happening::Saturation { clamped_share, beyond_travel } => {
                let travel = if *beyond_travel { ", and the master leaves its travel" } else { "" };
                write!(f, "a limit acts in {:.1} % of the contact{travel}", 100.0 * clamped_share)
            }
            Happening::NotJudged { why: why @ Unjudged::NoFeedback } => write!(f, "nothing to judge: {why}"),
            Happening::NotJudged { why } => write!(f, "it is not known whether the loop oscillates: {why}"),
        }
    }
}

/// Frequency and periods to a third of what rings after the first touch; `None` where nothing does.
fn ringing(trace: &Trace) -> Option<(f64, f64)> {
    let touch = trace.contact.iter().position(|f| *f != 0.0)?;
    let rows = (AFTER_TOUCH_S / trace.period_s) as usize;
    let piece = trace.position.get(touch..(touch + rows).min(trace.position.len()))?;
    let found = oscillation(piece, trace.period_s, LOWEST_HZ)?;
    let floor = FELT.max(8.0 * trace.resolution) + 10.0 * trace.noise;
    let periods = found.frequency_hz / -found.growth_per_s;
    (found.amplitude_before > floor && found.growth_per_s < 0.0 && periods > RINGS && found.frequency_hz > 1.5 * LOWEST_HZ)
        .then_some((found.frequency_hz, periods))
}

/// Whether the master stands still most of the time and goes on in jumps.
fn in_stairs(trace: &Trace) -> bool {
    let window = (0.02 / trace.period_s) as usize;
    // A few samples a step of the stairs say nothing of how it is climbed.
    if window < 4 {
        return false;
    }
    let touched: Vec<f64> = trace.position.iter().zip(&trace.contact).filter(|(_, f)| **f != 0.0).map(|(x, _)| *x).collect();
    let span = |piece: &[f64]| piece.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let (low, high) = span(&touched);
    let least = (0.02 * (high - low)).max(2.0 * trace.resolution);
    let pieces: Vec<bool> = touched
        .chunks_exact(window)
        .map(|piece| {
            let (low, high) = span(piece);
            high - low <= least
        })
        .collect();
    let standing = pieces.iter().filter(|still| **still).count();
    standing as f64 >= STANDS * pieces.len().max(1) as f64
}
