//! The verdict in one sentence.

use super::types::{Finding, Word};
use crate::belief::decision::{Decision, Doubt};
use crate::equation_error::OnForces;
use crate::hypothesis::Place;
use crate::tuning::tuning;
use crate::verdict::words;
use backdrive_plant::write::round_significant;

/// `planned`: whether there is a next experiment.
pub(super) fn sentence(decision: &Decision, planned: bool) -> String {
    let said = without_reserve(decision, planned);
    let doubt = match decision.doubt {
        None => return said,
        Some(Doubt::WorseThanGiven) => {
            "but with it the held-out recordings are predicted worse than by the nominal model, so the nominal model is written"
        }
        Some(Doubt::WorseSimulated) => {
            "but simulated from the force, the held-out motion is predicted worse with it than by the nominal model, so the nominal model \
                is written"
        }
        Some(Doubt::WorseThanRefit) => "but the refitted nominal model predicts held-out recordings better, so the finding is uncertain",
        Some(Doubt::AtAnEnd) => {
            "but a parameter is at the bound of its search range, so the finding is uncertain: check the parameters of the model file"
        }
    };
    format!("{}; {doubt}", said.replacen("the model leaves out", "the model may leave out", 1))
}

fn without_reserve(decision: &Decision, planned: bool) -> String {
    let (best, findings) = (decision.best, decision.findings.as_slice());
    let level = best.levels.iter().fold(0.0f64, |a, b| a.max(*b));
    let times = round_significant(level, 2);
    let noise = decision.forces.map_or("the sensor noise", OnForces::noise);
    // Below this the residual is the sensor's noise up to chance and rounding.
    let of_force = decision
        .left_of_force
        .filter(|_| decision.forces.is_some_and(|forces| !forces.is_at_noise()))
        .map(|share| format!("{}", round_significant(100.0 * share, 2)));
    let end = if let Some(percent) = &of_force {
        format!("down to {percent} % of the force, which none of the tested laws explains")
    } else if level < tuning().noise.unexplained {
        format!("down to {noise}")
    } else {
        format!("to {times} times {noise}")
    };
    let still = if level < tuning().noise.unexplained { String::new() } else { format!("; the residual is still {times} times {noise}") };
    let unseen = decision
        .unseen
        .map_or_else(String::new, |level| format!("; the error on held-out recordings is {} times {noise}", round_significant(level, 2)));
    let all = findings.iter().map(asserted).collect::<Vec<_>>().join(", and ");
    match decision.word {
        Word::Ambiguous => {
            let next = if planned { ", the next experiment would" } else { "" };
            format!("the model leaves out {}: the recordings do not separate them{next}{still}{unseen}", sure_then_open(findings))
        }
        Word::CannotTell if !findings.is_empty() => {
            let what = sure_then_open(findings);
            format!("the model leaves out {what}: neither these recordings nor a planned experiment can separate them{still}{unseen}")
        }
        Word::CannotTell => "the device hardly moves in the recordings: they do not show what is missing".to_string(),
        Word::Missing if decision.at_floor && !still.is_empty() => {
            format!("the model leaves out {all}; with it the recordings are explained down to the repeatability of the device")
        }
        Word::Missing if still.is_empty() => format!("the model leaves out {all}; with it the recordings are explained {end}{unseen}"),
        Word::Missing => format!("the model leaves out {all}; a residual of {times} times {noise} remains unexplained{unseen}"),
        Word::Unexplained => format!(
            "an effect is missing that none of the tested laws explains; the refitted model explains the \
            recordings {end}{unseen}"
        ),
        Word::Parameters => format!(
            "no effect is missing, but the model's parameters are wrong; refitted, they explain the recordings \
            {end}"
        ),
        Word::NothingMissing => format!("the model explains the recordings {end}"),
    }
}

/// What is sure, and what is one of several: of the first open finding its rivals too.
fn sure_then_open(findings: &[Finding]) -> String {
    let joined =
        |findings: &[&Finding], words: fn(&Finding) -> String| findings.iter().map(|f| words(f)).collect::<Vec<_>>().join(", and ");
    let (sure, open): (Vec<&Finding>, Vec<&Finding>) = findings.iter().partition(|f| f.is_sure());
    let (sure, open) = if open.is_empty() { (Vec::new(), sure) } else { (sure, open) };
    let Some((first, others)) = open.split_first() else { return "an effect".to_string() };
    let mut text = if sure.is_empty() { String::new() } else { format!("{}; it may also leave out ", joined(&sure, words::finding)) };
    text += &known(first);
    if !others.is_empty() {
        text += &format!(", besides {}", joined(others, asserted));
    }
    text
}

/// A finding in words; where a rival is more likely, what is known of both.
fn asserted(finding: &Finding) -> String {
    if finding.has_likelier_rival() { known(finding) } else { words::finding(finding) }
}

/// What is known where the explanations cannot be separated: the finding and its rivals that are at least half as likely, at most three.
fn known(finding: &Finding) -> String {
    let near = finding
        .alternatives
        .iter()
        .filter(|rival| rival.confidence >= tuning().claim.near_rival * finding.confidence)
        .take(tuning().claim.rivals);
    let all: Vec<(&str, &Place)> = std::iter::once((finding.physics.as_str(), &finding.place))
        .chain(near.map(|rival| (rival.physics.as_str(), &rival.place)))
        .collect();
    words::any_of(&all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verdict::types::Alternative;
    use std::collections::BTreeMap;

    #[test]
    fn what_is_sure_is_asserted_apart_from_what_is_one_of_several() {
        let finding = |physics: &str, confidence: f64, rival: Option<(&str, f64)>| {
            let place = Place::Between("motor".to_string(), "ground".to_string());
            let alternatives =
                rival.map(|(physics, confidence)| Alternative { physics: physics.to_string(), place: place.clone(), confidence });
            Finding {
                physics: physics.to_string(),
                place: place.clone(),
                parameters: BTreeMap::new(),
                replaces: Vec::new(),
                confidence,
                family: None,
                family_confidence: 0.0,
                alternatives: alternatives.into_iter().collect(),
                closed_loop: None,
            }
        };
        let open = finding("stribeck", 0.5, Some(("coulomb", 0.45)));
        let sure = finding("cogging", 0.99, None);
        assert_eq!(
            sure_then_open(&[open.clone(), sure.clone()]),
            format!("{}; it may also leave out {}", words::finding(&sure), known(&open))
        );
        assert_eq!(sure_then_open(std::slice::from_ref(&open)), known(&open));
        assert_eq!(sure_then_open(std::slice::from_ref(&sure)), known(&sure));
    }

    #[test]
    fn a_finding_that_is_less_likely_than_its_rival_is_not_asserted() {
        let at = |body: &str| Place::Between(body.to_string(), "ground".to_string());
        let first = |confidence: f64, rival: f64| Finding {
            physics: "coulomb".to_string(),
            place: at("motor"),
            parameters: BTreeMap::new(),
            replaces: Vec::new(),
            confidence,
            family: None,
            family_confidence: 0.0,
            alternatives: vec![Alternative { physics: "coulomb".to_string(), place: at("drum"), confidence: rival }],
            closed_loop: None,
        };
        assert!(first(0.04, 0.10).has_likelier_rival() && !first(0.97, 0.03).has_likelier_rival());
        assert_eq!(asserted(&first(0.04, 0.10)), "dry friction, at the motor or at the drum");
        assert_eq!(asserted(&first(0.97, 0.03)), "dry friction at the motor");
        assert_eq!(known(&first(0.04, 0.10)), "dry friction, at the motor or at the drum");
        assert_eq!(known(&first(0.97, 0.03)), "dry friction, at the motor");
    }
}
