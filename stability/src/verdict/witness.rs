//! One method that tests whether a gain is stable, with its result.

use super::word::{Method, Word};
use crate::outcome::Outcome;
use crate::resimulate::edge::Edge;
use serde::Serialize;

/// One method, with its result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Witness {
    /// Such as `the loop run again with a grip 1.15 times as firm`.
    pub name: String,
    /// By which method.
    pub method: Method,
    /// Factor on the grip; `None` for measurements with the recorded hand.
    pub grip: Option<f64>,
    /// At the gain asked about.
    pub verdict: Word,
    /// What was seen there, in words.
    pub seen: String,
    /// The lowest mu*lambda at which it is not stable; `None` where none is known.
    pub critical_gain: Option<f64>,
    /// Highest mu*lambda up to which it is known to be stable.
    pub at_least: Option<f64>,
    /// Frequency at the stability limit, Hz; 0 for a run-away without oscillation; `None` where it is not known.
    pub frequency_hz: Option<f64>,
    /// The outcome above the stability limit.
    #[serde(skip)]
    pub beyond: Option<Outcome>,
}

impl Witness {
    /// Of the re-simulation.
    pub(super) fn of_run(name: String, grip: f64, at_asked: &Outcome, edge: &Edge) -> Witness {
        Witness {
            name,
            method: Method::Resimulation,
            grip: Some(grip),
            verdict: Word::of(at_asked),
            seen: at_asked.to_string(),
            critical_gain: edge.critical_gain,
            at_least: Some(edge.at_least),
            frequency_hz: edge.frequency_hz,
            beyond: edge.outcome_beyond,
        }
    }

    /// Where its stable range ends: at a stability limit, or where a clamp comes first.
    pub(super) fn end(&self) -> Option<f64> {
        let limited = matches!(self.beyond, Some(Outcome::Limited { .. }));
        self.critical_gain.or(self.at_least.filter(|_| limited))
    }

    /// Its verdict at the gain: a gain above its stability limit is not stable, even where one run there looks so.
    pub(super) fn word_at(&self, gain: f64) -> Word {
        match (self.verdict, self.end()) {
            (Word::Stable, Some(end)) if gain >= end => self.beyond.as_ref().map_or(Word::Unstable, Word::of),
            (word, _) => word,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn witness(verdict: Word, edge: f64) -> Witness {
        Witness {
            name: "a run".into(),
            method: Method::Resimulation,
            grip: Some(1.0),
            verdict,
            seen: verdict.text().into(),
            critical_gain: Some(edge),
            at_least: Some(0.99 * edge),
            frequency_hz: Some(60.0),
            beyond: Some(Outcome::LimitCycle { amplitude_m: 1e-3, frequency_hz: 60.0, unit: Default::default() }),
        }
    }

    #[test]
    fn a_stable_run_beyond_its_edge_is_not_stable() {
        assert_eq!(witness(Word::Stable, 3.0).word_at(2.0), Word::Stable);
        assert_eq!(witness(Word::Stable, 3.0).word_at(3.5), Word::LimitCycle);
        assert_eq!(witness(Word::CannotTell, 3.0).word_at(2.0), Word::CannotTell);
        let limited = Witness {
            critical_gain: None,
            beyond: Some(Outcome::Limited { clamped_share: 0.2, beyond_travel: false }),
            ..witness(Word::Stable, 3.0)
        };
        assert_eq!((limited.end(), limited.word_at(3.5)), (Some(0.99 * 3.0), Word::Limited));
    }
}
