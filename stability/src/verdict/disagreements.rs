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
                text: format!("{check}: an effect is missing from the model, or its parameters are wrong"),
            });
        }
        if let Some(check) = self.loop_check.filter(|c| !c.agrees) {
            let (is, explained) = (100.0 * check.difference, 100.0 * check.noise);
            let text = format!(
                "near the stability limit the measured loop differs by {is:.1} % from the loop of the models ({explained:.1} % is \
                    explained by noise)"
            );
            found.push(Disagreement { kind: Apart::Model, text });
        }
        if let (Some(answer), Some(again)) = (&self.frequency_answer, &self.resimulated) {
            let mut methods = |text| found.push(Disagreement { kind: Apart::Methods, text });
            if verdicts_differ(answer, &again.outcome) {
                let says = if answer.verdict == frequency::Verdict::Stable { "stable" } else { "unstable" };
                methods(format!(
                    "at mu*lambda = {:.3} the frequency response gives {says}, the re-simulation {}",
                    answer.gain, again.outcome
                ));
            }
            if edges_lie_apart(answer, &again.edge) {
                let model_is_off = self.checks.iter().any(|c| !c.agrees) || self.loop_check.is_some_and(|c| !c.agrees);
                methods(format!(
                    "the stability limit is {} by the frequency response and {} by the re-simulation: use the lower. {}",
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
        () if model_is_off => "The models do not reproduce the recording, so the re-simulation lacks an effect of the measured loop",
        () if amplitude_dependent => {
            "The measured limit depends on the amplitude of the dither: such a loop has a different limit for \
            each motion"
        }
        () if swapped.any() => "The exchanged parts are linearised in the frequency response, and nonlinear in the re-simulation",
        () => {
            "The frequency response is measured with the dither's small motion in contact; the re-simulation covers the whole motion of \
             the hand, where friction, hysteresis and contact differ"
        }
    }
}
