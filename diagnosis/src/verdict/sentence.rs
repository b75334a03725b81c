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
            "the held-out recordings are predicted worse with it than by the model as given, so the model is written as given"
        }
        Some(Doubt::WorseSimulated) => {
            "simulated from the force, the motion of the held-out recordings comes out worse with it than by the model as given, so the model is written as given"
        }
        Some(Doubt::WorseThanRefit) => {
            "recordings that no fit has seen are predicted better by the model with its numbers refitted and nothing added, so this is as likely as not"
        }
        Some(Doubt::AtAnEnd) => {
            "a number is at the end of what the fit may try, so this is as likely as not: check the numbers of the model file"
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
        format!("down to {percent} % of the force, which goes with none of the laws that were looked at")
    } else if level < tuning().noise.unexplained {
        format!("down to {noise}")
    } else {
        format!("to {times} times {noise}")
    };
    let still = if level < tuning().noise.unexplained { String::new() } else { format!("; the residual is still {times} times {noise}") };
    let unseen = decision.unseen.map_or_else(String::new, |level| {
        format!("; recordings that no fit has seen are predicted only to {} times {noise}", round_significant(level, 2))
    });
    let all = findings.iter().map(asserted).collect::<Vec<_>>().join(", and ");
    match decision.word {
        Word::Ambiguous => {
            let others = match findings.get(1..) {
                Some(others) if !others.is_empty() => {
                    format!(", beside {}", others.iter().map(asserted).collect::<Vec<_>>().join(", and "))
                }
                _ => String::new(),
            };
            let next = if planned { ", the next experiment would" } else { "" };
            let what = findings.first().map_or_else(|| "something".to_string(), known);
            format!("the model leaves out {what}{others}: the recordings cannot tell which{next}{still}{unseen}")
        }
        Word::CannotTell if !findings.is_empty() => {
            let what = findings.first().map_or_else(|| "something".to_string(), known);
            format!("the model leaves out {what}: neither the recordings nor a further one like them can tell which{still}{unseen}")
        }
        Word::CannotTell => "the recordings hardly move the device: they cannot tell what is missing".to_string(),
        Word::Missing if decision.at_floor && !still.is_empty() => {
            format!("the model leaves out {all}; with it the recordings are explained down to what the device repeats")
        }
        Word::Missing if still.is_empty() => format!("the model leaves out {all}; with it the recordings are explained {end}{unseen}"),
        Word::Missing => format!("the model leaves out {all}; beside that a residual of {times} times {noise} remains{unseen}"),
        Word::Unexplained => format!("something is missing that none of the laws tried explains; refitted, the model comes {end}{unseen}"),
        Word::Parameters => format!("nothing is missing, but the model's parameters are off; refitted they explain the recordings {end}"),
        Word::NothingMissing => format!("the model explains the recordings {end}"),
    }
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
