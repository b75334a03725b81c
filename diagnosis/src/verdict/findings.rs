//! What was found: each physics with its place, its parameters, and what else could stand there.

use super::choice::{contains, evidence};
use super::rounded::rounded;
use super::types::{Alternative, Detectable, Estimate, Estimates, Finding, Moved, Parameter};
use crate::candidate::Candidate;
use crate::hypothesis::Hypothesis;
use crate::intervals::Uncertainty;
use crate::problem::Problem;
use crate::search::Search;
use crate::structure::Role;
use crate::tuning::tuning;
use backdrive_plant::write::round_significant;
use std::collections::BTreeMap;

/// How far the residual is measuring error: 1 where it has its size and is as little correlated, less the more of either. A law
/// that only imitates what is there leaves a little over, and that little is not white.
pub(super) fn adequacy(best: &Candidate) -> f64 {
    let noise = &tuning().noise;
    let level = best.levels.iter().fold(0.0f64, |a, b| a.max(*b));
    let size = (-(level - noise.at_noise).max(0.0) / (noise.unexplained - 1.0)).exp();
    let whiteness = (-(best.correlation_time - noise.white_correlation).max(0.0) / noise.white_correlation).exp();
    (size * whiteness).max(tuning().claim.least_adequacy)
}

/// Each physics of a structure with its rivals, most important first.
pub(super) fn findings(search: &Search, best: &Candidate, spread: &Uncertainty, adequacy: f64) -> Vec<Finding> {
    let one = |which| (cost_without(search, best, which), finding(search, best, spread, adequacy, which));
    let mut all: Vec<(f64, Finding)> = (0..best.structure.added.len()).map(one).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().map(|(_, finding)| finding).collect()
}

fn finding(search: &Search, best: &Candidate, spread: &Uncertainty, adequacy: f64, which: usize) -> Finding {
    let hypothesis = &best.structure.added[which];
    let rivals = rivals(search, best, which);
    // The weight of each, softened: a simulator is never the device.
    // A richer law at the same place that fits no better is the same law.
    let nested = |rival: &Hypothesis| rival.place.same(&hypothesis.place) && contains(rival.physics, hypothesis);
    let weight = |(rival, behind): &(Hypothesis, f64)| {
        (-behind.max(0.0) / tuning().claim.softened).exp() * if nested(rival) { tuning().claim.richer } else { 1.0 }
    };
    let weights: Vec<f64> = rivals.iter().map(weight).collect();
    // And of those that promised as much, but were not fitted: little, for they did not win their race.
    let own = search.tried.iter().find(|t| t.id == hypothesis.id).map_or(1.0, |t| t.promised);
    let unfitted = search.tried.iter().filter(|t| t.taken.is_none() && t.promised > tuning().claim.as_promising * own).count() as f64;
    let sum = 1.0 + weights.iter().sum::<f64>() + tuning().claim.unfitted * unfitted.min(tuning().claim.unfitted_most);
    let alternative = |((rival, _), weight): (&(Hypothesis, f64), &f64)| Alternative {
        physics: rival.physics.name.to_string(),
        place: rival.place.clone(),
        confidence: round_significant(weight / sum, 3),
    };
    Finding {
        physics: hypothesis.physics.name.to_string(),
        place: hypothesis.place.clone(),
        parameters: parameters_of(best, spread, which),
        replaces: hypothesis.replaces.clone(),
        confidence: round_significant(adequacy / sum, 3),
        alternatives: rivals.iter().zip(&weights).take(tuning().claim.alternatives).map(alternative).collect(),
    }
}

/// What the cost would be without one of the physics: that tells how important it is.
fn cost_without(search: &Search, best: &Candidate, which: usize) -> f64 {
    let (added, id) = (&best.structure.added, &best.structure.added[which].id);
    let is_rest = |c: &&Candidate| {
        c.structure.added.len() + 1 == added.len() && c.structure.added.iter().all(|o| o.id != *id && added.iter().any(|b| b.id == o.id))
    };
    search.found.iter().filter(is_rest).map(|c| c.fit.cost).fold(search.nominal.fit.cost, f64::min)
}

/// What stands in the place of one hypothesis in structures that are else the same, and how far it is behind.
fn rivals(search: &Search, best: &Candidate, which: usize) -> Vec<(Hypothesis, f64)> {
    let own = &best.structure.added[which];
    let others: Vec<&str> = best.structure.added.iter().filter(|h| h.id != own.id).map(|h| h.id.as_str()).collect();
    let mut found: Vec<(Hypothesis, f64)> = Vec::new();
    for candidate in search.found.iter().filter(|c| c.structure.added.len() == best.structure.added.len()) {
        let added = &candidate.structure.added;
        let rest: Vec<&Hypothesis> = added.iter().filter(|h| !others.contains(&h.id.as_str())).collect();
        let [rival] = rest.as_slice() else { continue };
        if rival.id != own.id && added.len() - 1 == others.len() {
            found.push(((*rival).clone(), evidence(search, candidate, best)));
        }
    }
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    // However finely a law is resolved, it is one physics.
    let same = |a: &Hypothesis, b: &Hypothesis| a.physics == b.physics && a.place.same(&b.place);
    let mut each: Vec<(Hypothesis, f64)> = Vec::new();
    for (rival, behind) in found {
        if !same(&rival, own) && !each.iter().any(|(other, _)| same(&rival, other)) {
            each.push((rival, behind));
        }
    }
    each
}

fn parameters_of(best: &Candidate, spread: &Uncertainty, which: usize) -> BTreeMap<String, Parameter> {
    let hypothesis = &best.structure.added[which];
    let mut all = BTreeMap::new();
    for (index, number) in best.structure.free.iter().enumerate() {
        let Role::Added(h, p) = number.role else { continue };
        let Some(parameter) = hypothesis.parameters.get(p).filter(|_| h == which) else { continue };
        let value = round_significant(best.fit.values[index], 5);
        let ci95 = spread.interval(best, index).map(|end| rounded(end, 5));
        let unit = parameter.unit.clone();
        if parameter.index.is_some() {
            let none = || Parameter::List(Estimates { value: Vec::new(), ci95: Vec::new(), unit });
            if let Parameter::List(list) = all.entry(parameter.key.clone()).or_insert_with(none) {
                list.value.push(value);
                list.ci95.push(ci95);
            }
        } else {
            all.insert(parameter.key.clone(), Parameter::One(Estimate { value, ci95, unit }));
        }
    }
    all
}

/// Parameters of the nominal model as the fit has them, by their path.
pub(super) fn moved(problem: &Problem, best: &Candidate, spread: &Uncertainty) -> BTreeMap<String, Moved> {
    let mut all = BTreeMap::new();
    for (index, number) in best.structure.free.iter().enumerate() {
        let Role::Stated(i) = number.role else { continue };
        let (stated, value) = (&problem.stated[i], best.fit.values[index]);
        let list = problem.stated.iter().filter(|s| s.path == stated.path).count() > 1;
        let key = if list { format!("{}[{}]", stated.path, stated.index) } else { stated.path.clone() };
        let away = (number.to_internal(value) - number.to_internal(stated.given)) / spread.deviation[index];
        let moved = Moved {
            value: round_significant(value, 5),
            ci95: spread.interval(best, index).map(|end| rounded(end, 5)),
            nominal: stated.given,
            moved_sd: rounded(away, 3),
        };
        all.insert(key, moved);
    }
    all
}

/// What would have been seen: for each physics the smallest size at the place where it shows best.
pub(super) fn detectable(search: &Search) -> Vec<Detectable> {
    let one = |d: &crate::search::Detectable| Detectable {
        physics: d.physics.to_string(),
        place: d.place.clone(),
        unit: d.unit.to_string(),
        size: BTreeMap::from([(d.key.clone(), round_significant(d.size, 3))]),
    };
    search.detectable.iter().map(one).collect()
}
