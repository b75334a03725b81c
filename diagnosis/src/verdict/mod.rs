//! What a search says: the verdict file, and the nominal model's file with what was found.

mod choice;
mod findings;
mod models;
mod remaining;
mod signals;

pub use choice::chosen;

use crate::experiment::{excite, separate};
use crate::fit::Evaluator;
use crate::intervals::Spread;
use crate::problem::Problem;
use crate::search::{AT_FLOOR, Candidate, Search};
use crate::statistics::advantage;
use crate::structure::{Number, Role, Structure};
use crate::words;
use crate::work::{Budget, Limit, Steps};
use backdrive_plant::write::round_significant;
use choice::{alike, nearest};
use findings::{adequacy, detectable, findings, moved};
use models::{held_out, model_text, rival_models};
use remaining::remaining;
use serde_json::{Value as Json, json};
use signals::{bursts, place_in_signals, unknown_inputs};

/// A verdict, ready to be written.
#[derive(Debug)]
pub struct Verdict {
    /// The verdict file.
    pub json: Json,
    /// The model file with what was found.
    pub model: String,
    /// Models of other explanations that leave over little more, the nearest first: what is built on the verdict has to stand with these too.
    pub rivals: Vec<String>,
    /// In one sentence.
    pub sentence: String,
    /// The excitation file of the next experiment, to be written as [`EXPERIMENT_FILE`]; `None` where none is needed or can be had.
    pub experiment: Option<String>,
}

/// Name of the file of the next experiment.
pub const EXPERIMENT_FILE: &str = "next-experiment.toml";
/// Name of the file of a rival's model, from 1.
pub fn rival_file(number: usize) -> String {
    format!("model.rival-{number}.toml")
}

/// Work in which the next experiment is looked for.
const EXPERIMENT: Steps = 100_000_000;

/// Why a verdict cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum VerdictError {
    /// The model's text cannot be edited.
    #[error(transparent)]
    Patch(#[from] backdrive_plant::write::PatchError),
    /// Refitted numbers cannot be put into the model.
    #[error("the refitted numbers do not fit into the model: {0}")]
    Refitted(String),
    /// A physics that was found cannot be put into the model.
    #[error(transparent)]
    Hypothesis(#[from] crate::hypothesis::HypothesisError),
}

/// Distance from white noise, standard deviations of chance, beyond which something is left over however small it is: fits of the right structure
/// stay below 3, and 2 or 3 times that where they stop before their end.
const WANDERS: f64 = 12.0;
/// Level above which what is left over is no measuring error.
const LEFT_OVER: f64 = 1.15;

/// Says what a search found. `model_name` is the name under which the model will be written.
///
/// # Errors
/// When what was found cannot be written into the model's text.
pub fn verdict(problem: &Problem, search: &Search, model_name: &str) -> Result<Verdict, VerdictError> {
    let best = chosen(search);
    let evaluator = Evaluator { floor: search.floor.clone(), ..Evaluator::new(problem) };
    let spread = Spread::measured(&evaluator, best);
    let at_floor = best.levels.iter().all(|l| *l < LEFT_OVER);
    let nominal_cost = search.nominal.fit.cost;
    let excess = |c: f64| (c / search.samples as f64 - 1.0).max(0.0);
    let explained = 1.0 - excess(best.fit.cost) / excess(nominal_cost).max(1e-12);
    let added = !best.structure.added.is_empty();
    let bursts = bursts(problem, best);
    let alike = alike(search, best);
    let nominal = &search.nominal;
    let off = given_is_off(problem, search) && (added || spread.is_far(nominal, &stated_in(problem, &nominal.structure)));
    let wanders = nominal.slowness > WANDERS && nominal.levels.iter().any(|l| *l > AT_FLOOR);
    let findings = findings(search, best, &spread, adequacy(best));
    let word = match () {
        () if added && (at_floor || explained > 0.99) && (!alike.is_empty() || is_outdone(&findings)) => "ambiguous",
        () if added && (at_floor || explained > 0.99) => "missing",
        () if added => "unexplained",
        () if !bursts.is_empty() => "unexplained",
        () if !at_floor && nominal.correlation_time > 3.0 || wanders => "unexplained",
        () if off => "parameters",
        () if !is_excited(problem, search) => "cannot_tell",
        () => "nothing_missing",
    };
    let budget = Budget::new(EXPERIMENT, Limit::default());
    let planned = match word {
        "ambiguous" => {
            let rivals = if alike.is_empty() { nearest(search, best) } else { alike.clone() };
            Some(separate(problem, &[&[best], rivals.as_slice()].concat(), &search.floor, &budget))
        }
        "cannot_tell" => best.structure.model(problem, &best.fit.values).map(|model| {
            let all: Vec<usize> = (0..best.structure.numbers.len()).collect();
            excite(problem, &model, &best.structure, &best.fit.values, &all, &search.floor, &budget)
        }),
        _ => None,
    };
    let (next, experiment) = match planned {
        Some(Ok(plan)) => (plan.json(EXPERIMENT_FILE), Some(plan.text)),
        Some(Err(reason)) => (json!({ "sentence": reason.to_string() }), None),
        None => (Json::Null, None),
    };
    let held = held_out(problem, search, best, off || added);
    let model = model_text(problem, best, &spread, off || added)?;
    let parameters = if off || added { moved(problem, best, &spread) } else { json!({}) };
    let sentence = sentence(word, best, &findings, next["sentence"].as_str().is_none() && experiment.is_some());
    let rivals = rival_models(problem, search, best);
    let json = json!({
        "schema": 1,
        "verdict": word,
        "sentence": sentence,
        "findings": findings,
        "where": place_in_signals(problem, &search.nominal.fit.residuals, &bursts),
        "parameters": parameters,
        "remaining": remaining(problem, search, best, &held),
        "held_out": held,
        "unknown_inputs": unknown_inputs(problem, best),
        "model_after": model_name,
        "rival_models": (1..=rivals.len()).map(rival_file).collect::<Vec<_>>(),
        "next_experiment": next,
        "detectable": if added { Json::Null } else { detectable(search) },
    });
    Ok(Verdict { json, model, rivals, sentence, experiment })
}

/// Whether the refitted numbers explain more than the given ones do.
fn given_is_off(problem: &Problem, search: &Search) -> bool {
    let each: Vec<f64> = search.levels_given.clone();
    let total: usize = problem.fit.iter().map(|r| crate::fit::measured(r).map(|_| r.len).sum::<usize>()).sum();
    let mut cost = 0.0;
    for record in &problem.fit {
        for output in crate::fit::measured(record) {
            cost += each.get(output).map_or(0.0, |l| l * l) * record.len as f64;
        }
    }
    let refit = &search.nominal;
    let numbers = refit.structure.numbers.len();
    advantage(cost, 0, refit.fit.cost, numbers, total, refit.correlation_time) > 0.0 && refit.fit.cost < 0.99 * cost
}

/// Where the stated numbers are among a structure's, and what the nominal file says.
fn stated_in(problem: &Problem, structure: &Structure) -> Vec<(usize, f64)> {
    let one = |(place, number): (usize, &Number)| match number.role {
        Role::Stated(i) => Some((place, problem.stated.get(i)?.given)),
        _ => None,
    };
    structure.numbers.iter().enumerate().filter_map(one).collect()
}

/// Whether the recordings move the device by more than the measuring error.
fn is_excited(problem: &Problem, search: &Search) -> bool {
    let moves = |(output, floor): (usize, &f64)| {
        problem.fit.iter().any(|r| r.outputs.get(output).is_some_and(Option::is_some) && r.spread[output] > 5.0 * floor)
    };
    search.floor.iter().enumerate().any(moves)
}

/// Whether a rival of the first finding is more likely than the finding itself: then the finding is not asserted.
fn is_outdone(findings: &[Json]) -> bool {
    findings.first().is_some_and(has_likelier_rival)
}

fn has_likelier_rival(finding: &Json) -> bool {
    let confidence = |f: &Json| f["confidence"].as_f64().unwrap_or(0.0);
    finding["alternatives"].as_array().into_iter().flatten().any(|rival| confidence(rival) >= confidence(finding))
}

/// A finding in words; where a rival is more likely, what is known of both.
fn asserted(finding: &Json) -> String {
    if has_likelier_rival(finding) { known(std::slice::from_ref(finding)) } else { words::finding(finding) }
}

/// What is known where the explanations cannot be told apart: the first finding and the rivals that are at least half as likely, at most three.
fn known(findings: &[Json]) -> String {
    let confidence = |f: &Json| f["confidence"].as_f64().unwrap_or(0.0);
    let Some(first) = findings.first() else { return "something".to_string() };
    let rivals = first["alternatives"].as_array().into_iter().flatten();
    let near: Vec<&Json> = rivals.filter(|rival| confidence(rival) >= 0.5 * confidence(first)).take(3).collect();
    words::any_of(&[&[first], near.as_slice()].concat())
}

fn sentence(word: &str, best: &Candidate, findings: &[Json], planned: bool) -> String {
    let level = best.levels.iter().fold(0.0f64, |a, b| a.max(*b));
    let times = round_significant(level, 2);
    // Below this the residual is the sensor's noise up to chance and rounding.
    let end = if level < LEFT_OVER { "down to the sensor noise".to_string() } else { format!("to {times} times the sensor noise") };
    let still = if level < LEFT_OVER { String::new() } else { format!("; the residual is still {times} times the sensor noise") };
    let all = findings.iter().map(asserted).collect::<Vec<_>>().join(", and ");
    match word {
        "ambiguous" => {
            let others = match findings.get(1..) {
                Some(others) if !others.is_empty() => {
                    format!(", beside {}", others.iter().map(asserted).collect::<Vec<_>>().join(", and "))
                }
                _ => String::new(),
            };
            let next = if planned { ", the next experiment would" } else { "" };
            format!("the model leaves out {}{others}: the recordings cannot tell which{next}{still}", known(findings))
        }
        "cannot_tell" => "the recordings hardly move the device: they cannot tell what is missing".to_string(),
        "missing" if still.is_empty() => format!("the model leaves out {all}; with it the recordings are explained {end}"),
        "missing" => format!("the model leaves out {all}{still}"),
        "unexplained" if best.structure.added.is_empty() => {
            format!("something is missing that none of the laws tried explains; refitted, the model comes {end}")
        }
        "unexplained" => format!("something is missing that no known physics explains; the nearest is {all}{still}"),
        "parameters" => format!("nothing is missing, but the model's parameters are off; refitted they explain the recordings {end}"),
        _ => format!("the model explains the recordings {end}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_that_is_less_likely_than_its_rival_is_not_asserted() {
        let rival = |c: f64| json!({ "physics": "coulomb", "between": ["drum", "ground"], "confidence": c });
        let first =
            |c: f64, r: f64| json!({ "physics": "coulomb", "between": ["motor", "ground"], "confidence": c, "alternatives": [rival(r)] });
        assert!(is_outdone(&[first(0.04, 0.10)]));
        assert!(!is_outdone(&[first(0.97, 0.03)]) && !is_outdone(&[]));
        assert_eq!(asserted(&first(0.04, 0.10)), "dry friction, at the motor or at the drum");
        assert_eq!(asserted(&first(0.97, 0.03)), "dry friction at the motor");
        assert_eq!(known(&[first(0.04, 0.10)]), "dry friction, at the motor or at the drum");
        assert_eq!(known(&[first(0.97, 0.03)]), "dry friction, at the motor");
    }
}
