//! Where answers and models part.

use super::question::Swapped;
use super::types::{Answer, Apart, Disagreement};
use crate::frequency::{self, FrequencyAnswer};
use crate::outcome::Outcome;
use crate::resimulate::edge::Edge;

impl Answer {
    /// Lists contradictions: between models and recording, and between the methods.
    pub(super) fn find_disagreements(&mut self, swapped: Swapped) {
        let mut found = Vec::new();
        for check in self.checks.iter().filter(|c| !c.agrees) {
            found.push(Disagreement {
                kind: Apart::Model,
                text: format!("{check}: the model leaves something out or its numbers are wrong"),
            });
        }
        if let Some(check) = self.loop_check.filter(|c| !c.agrees) {
            let (is, explained) = (100.0 * check.difference, 100.0 * check.noise);
            let text =
                format!("near the edge the measured loop is {is:.1} % off the loop that the models make ({explained:.1} % would be noise)");
            found.push(Disagreement { kind: Apart::Model, text });
        }
        if let (Some(answer), Some(again)) = (&self.frequency_answer, &self.resimulated) {
            let mut methods = |text| found.push(Disagreement { kind: Apart::Methods, text });
            if verdicts_differ(answer, &again.outcome) {
                let says = if answer.verdict == frequency::Verdict::Stable { "stable" } else { "unstable" };
                methods(format!(
                    "at mu*lambda = {:.3} the frequency response says {says}, the re-simulation {}",
                    answer.gain, again.outcome
                ));
            }
            if edges_lie_apart(answer, &again.edge) {
                let model_is_off = self.checks.iter().any(|c| !c.agrees) || self.loop_check.is_some_and(|c| !c.agrees);
                methods(format!(
                    "the edge is {} by the frequency response and {} by the re-simulation: act on the lower. {}",
                    edge_in_words(answer.critical_gain, answer.at_least),
                    edge_in_words(again.edge.critical_gain, Some(again.edge.at_least)),
                    why_apart(swapped, answer.amplitude_dependent, model_is_off)
                ));
            }
        }
        self.disagreements = found;
    }

    /// Whether a model does something else than was recorded.
    pub fn mismatch(&self) -> bool {
        self.disagreements.iter().any(|d| d.kind == Apart::Model)
    }
}

/// Whether one verdict is stable and the other is not.
fn verdicts_differ(answer: &FrequencyAnswer, again: &Outcome) -> bool {
    match answer.verdict {
        frequency::Verdict::Stable => matches!(again, Outcome::LimitCycle { .. } | Outcome::Unstable { .. }),
        frequency::Verdict::Unstable => again.is_stable(),
        frequency::Verdict::CannotTell => false,
    }
}

/// Whether the stability limits differ by more than 5 % beyond the interval of the measured one.
fn edges_lie_apart(answer: &FrequencyAnswer, again: &Edge) -> bool {
    match (answer.critical_gain_ci95, again.critical_gain) {
        (Some((low, high)), Some(edge)) => edge < 0.95 * low || high.is_some_and(|h| edge > 1.05 * h),
        (None, Some(edge)) => answer.at_least.is_some_and(|least| edge < 0.95 * least),
        (Some((_, Some(high))), None) => again.at_least > 1.05 * high,
        (Some((_, None)) | None, None) => false,
    }
}

fn edge_in_words(gain: Option<f64>, least: Option<f64>) -> String {
    match (gain, least) {
        (Some(gain), _) => format!("{gain:.3}"),
        (None, Some(least)) => format!("above {least:.3}"),
        (None, None) => "nowhere".to_string(),
    }
}

/// Why the measured response and the re-simulation may give different stability limits.
fn why_apart(swapped: Swapped, amplitude_dependent: bool, model_is_off: bool) -> &'static str {
    match () {
        () if model_is_off => {
            "The models do not do what was recorded, so that the re-simulation lacks something that the measured loop has"
        }
        () if amplitude_dependent => "The measured edge depends on the amplitude of the dither: such a loop has an edge for each motion",
        () if swapped.any() => "The exchanged parts enter the frequency response linearised, and the re-simulation as they are",
        () => {
            "The frequency response is that of the dither's small motion in contact; the re-simulation goes through the hand's whole motion, in which \
             friction, hysteresis and touching differ"
        }
    }
}
