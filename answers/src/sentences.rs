//! Parts of a verdict in words, for terminal and page.

use backdrive_diagnosis::hypothesis::Family;
use backdrive_diagnosis::output_error::error_budget::{BudgetedError, Source};
use backdrive_diagnosis::verdict::words;
use backdrive_diagnosis::verdict::{Alternative, Estimate, Finding, Interval, NextExperiment, Parameter, Where};
use backdrive_report::{number, si};

/// How sure a finding is: `well supported (97 %)`; where its kind is surer than its law, `dry friction there: well supported (97 %); this law of it: weakly
/// supported (41 %)`.
pub fn confidence(finding: &Finding) -> String {
    let own = supported(finding.confidence);
    match finding.family.and_then(Family::words) {
        Some(kind) if finding.family_confidence > finding.confidence + 0.1 => {
            format!("{kind} there: {}; this law: {own}", supported(finding.family_confidence))
        }
        _ => own,
    }
}

/// `well supported (97 %)`, in words and percent.
fn supported(share: f64) -> String {
    let word = match share {
        s if s > 0.95 => "well supported",
        s if s > 0.8 => "supported",
        s if s > 0.4 => "weakly supported",
        s if s > 0.05 => "barely supported",
        _ => "not supported by the residual",
    };
    format!("{word} ({})", words::share(share))
}

/// The words for an effect. Axes, arms and servo joints each have their own list of effects.
pub type Words = fn(&str) -> String;

/// A finding in a line: `dry friction at the drum, instead of damper: force 101 mN (95 %: 98.0 mN to 104 mN); well supported (97 %)`.
pub fn described(finding: &Finding, effect: Words) -> String {
    let instead = if finding.replaces.is_empty() { String::new() } else { format!(", instead of {}", finding.replaces.join(" and ")) };
    let (effect, place) = (effect(&finding.physics), words::place(&finding.place));
    format!("{effect} {place}{instead}: {}; {}", parameters(finding).join(", "), confidence(finding))
}

/// What could be instead of a finding, the three likeliest: `backlash between motor and drum (3 %)`.
pub fn alternatives(finding: &Finding, effect: Words) -> Vec<String> {
    let one =
        |other: &Alternative| format!("{} {} ({})", effect(&other.physics), words::place(&other.place), words::share(other.confidence));
    finding.alternatives.iter().take(3).map(one).collect()
}

/// A value with its interval: `101 mN (95 %: 98.0 mN to 104 mN)`.
fn with_interval(value: f64, ci95: &Interval, unit: &str) -> String {
    let interval = match ci95 {
        // Three digits do not show a narrow interval.
        [Some(low), Some(high)] if si(*low, unit) == si(*high, unit) => format!("95 %: ±{}", si(0.5 * (high - low), unit)),
        [Some(low), Some(high)] => format!("95 %: {} to {}", si(*low, unit), si(*high, unit)),
        [Some(low), None] => format!("95 %: above {}", si(*low, unit)),
        [None, Some(high)] => format!("95 %: below {}", si(*high, unit)),
        [None, None] => "not determined".to_string(),
    };
    format!("{} ({interval})", si(value, unit))
}

/// A parameter with its interval, and whether it is at its bound.
pub fn estimate(estimate: &Estimate) -> String {
    let Estimate { value, ci95, unit, at_bound } = estimate;
    format!("{}{}", with_interval(*value, ci95, unit), if *at_bound { ", at its bound" } else { "" })
}

/// A parameter of a verdict: value and interval, or lists of them.
fn parameter(parameter: &Parameter) -> String {
    match parameter {
        Parameter::One(one) => estimate(one),
        Parameter::List(list) => {
            let each = list.value.iter().zip(&list.ci95).map(|(value, ci95)| with_interval(*value, ci95, &list.unit));
            each.collect::<Vec<_>>().join("; ")
        }
    }
}

/// A finding's parameters, each with its name: `force 101 mN (95 %: 98.0 mN to 104 mN)`.
pub fn parameters(finding: &Finding) -> Vec<String> {
    finding.parameters.iter().map(|(key, value)| format!("{} {}", key.replace('_', " "), parameter(value))).collect()
}

/// When, at which frequencies and in which state.
pub fn shows(place: &Where) -> String {
    let mut parts: Vec<String> = place.state.iter().cloned().collect();
    let [low, high] = place.band_hz;
    parts.push(format!("{} to {}", si(low, "Hz"), si(high, "Hz")));
    if let Some([from, to]) = place.time.first() {
        parts.push(format!("most at {} to {} s", number(*from), number(*to)));
    }
    parts.join("; ")
}

/// Errors of predictions although no effect is missing, where they are a tenth of the noise or more: `noise of a motion that drives the model 0.93
/// (force)`.
pub fn errors(budget: &[BudgetedError]) -> Option<String> {
    let told = |source: Source| match source {
        Source::Integration => "integration",
        Source::Clock => "jitter of the clock",
        Source::Differencing => "differences of counts instead of a velocity",
        Source::Rounding => "rounding of the output",
        Source::Hold => "the input between samples",
        Source::DrivingMotion => "noise of a motion that drives the model",
    };
    let large = budget.iter().filter(|error| error.noise_sd >= 0.1);
    let all: Vec<String> = large.map(|e| format!("{} {} ({})", told(e.source), number(e.noise_sd), e.output)).collect();
    (!all.is_empty()).then(|| format!("errors that are not missing effects, in units of the sensor noise: {}", all.join(", ")))
}

/// What to record next, and the file that plays it; or why nothing would tell.
pub fn next_experiment(next: &NextExperiment) -> String {
    match next.file() {
        Some(file) => format!("{} ({file})", next.sentence()),
        None => next.sentence().to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_diagnosis::hypothesis::Place;
    use backdrive_diagnosis::verdict::{Estimates, Refused};
    use std::collections::BTreeMap;

    #[test]
    fn a_finding_reads_as_a_line_with_parameters_and_confidence() {
        let force = Parameter::One(Estimate { value: 0.101, ci95: [Some(0.098), Some(0.104)], at_bound: false, unit: "N".to_string() });
        let finding = Finding {
            physics: "coulomb".to_string(),
            place: Place::Between("drum".to_string(), "ground".to_string()),
            parameters: BTreeMap::from([("force".to_string(), force)]),
            replaces: Vec::new(),
            confidence: 0.97,
            family: None,
            family_confidence: 0.0,
            alternatives: Vec::new(),
            closed_loop: None,
        };
        let line = "dry friction at the drum: force 101 mN (95 %: 98.0 mN to 104 mN); well supported (97 %)";
        assert_eq!(described(&finding, words::physics), line);
        let of_some_law = Finding { confidence: 0.13, family: Some(Family::Friction), family_confidence: 0.97, ..finding };
        assert_eq!(confidence(&of_some_law), "dry friction there: well supported (97 %); this law: barely supported (13 %)");
        let stiff = Parameter::One(Estimate { value: 2.0, ci95: [Some(1.5), None], at_bound: true, unit: "N".to_string() });
        assert_eq!(parameter(&stiff), "2.00 N (95 %: above 1.50 N), at its bound");
        let replacing =
            Finding { replaces: vec!["damper".to_string()], parameters: BTreeMap::from([("force".to_string(), stiff)]), ..of_some_law };
        assert!(described(&replacing, words::physics).starts_with("dry friction at the drum, instead of damper: force 2.00 N"));
        let ci95 = vec![[Some(0.5), Some(1.5)], [Some(1.0), Some(3.0)]];
        let slip = Parameter::List(Estimates { value: vec![1.0, 2.0], ci95, unit: "N".to_string() });
        assert_eq!(parameter(&slip), "1.00 N (95 %: 500 mN to 1.50 N); 2.00 N (95 %: 1.00 N to 3.00 N)");
    }

    #[test]
    fn errors_that_are_no_physics_are_told_where_they_are_large() {
        let error = |source: Source, noise_sd: f64| BudgetedError { source, output: "force".to_string(), noise_sd };
        let budget = [error(Source::Integration, 1e-9), error(Source::DrivingMotion, 0.93)];
        let said = "errors that are not missing effects, in units of the sensor noise: noise of a motion that drives the model 0.93 \
            (force)";
        assert_eq!(errors(&budget).map(|text| text.replace("0.930", "0.93")).as_deref(), Some(said));
        assert_eq!(errors(&budget[..1]), None);
    }

    #[test]
    fn where_no_experiment_would_tell_the_reason_is_told() {
        let refused = NextExperiment::Refused(Refused { sentence: "No excitation separates them.".to_string() });
        assert_eq!(next_experiment(&refused), "No excitation separates them.");
    }
}
