//! What was found: each effect with its place, its parameters, and its alternatives.

use super::rounded::rounded;
use super::types::{Alternative, Detectable, Estimate, Estimates, Finding, Moved, Parameter};
use crate::belief::choice::{behind, chosen, evidence, exchanged};
use crate::belief::confidence::{Figures, figures, probability, probability_of_family, without};
use crate::belief::intervals::Uncertainty;
use crate::belief::plausible::is_timing;
use crate::hypothesis::Hypothesis;
use crate::output_error::candidate::Candidate;
use crate::output_error::structure::Role;
use crate::recordings::problem::Problem;
use crate::search::Search;
use crate::tuning::tuning;
use backdrive_plant::write::round_significant;
use std::collections::BTreeMap;

/// Each effect of a structure that is claimed, with its rivals, most important first. What comes late by a small share of a sample is a matter of timing,
/// and not among them.
pub(crate) fn findings(problem: &Problem, search: &Search, best: &Candidate, spread: &Uncertainty) -> Vec<Finding> {
    let is_companion = |which: usize| {
        let companions = search.forces.as_ref().map_or(&[][..], |forces| forces.companions.as_slice());
        best.structure.added.get(which).is_some_and(|h| companions.contains(&h.id))
    };
    let claimed = (0..best.structure.added.len()).filter(|which| !is_timing_of(problem, best, *which) && !is_companion(*which));
    let one = |which| (without(search, best, which).fit.cost, finding(search, best, spread, which));
    let mut all: Vec<(f64, Finding)> = claimed.map(one).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().map(|(_, finding)| finding).collect()
}

/// Whether one of the effects of a structure is a matter of timing.
pub(crate) fn is_timing_of(problem: &Problem, best: &Candidate, which: usize) -> bool {
    let period = problem.fit.iter().map(|r| r.period).fold(f64::INFINITY, f64::min);
    let values = best.structure.added_of(&best.fit.values);
    best.structure.added.get(which).zip(values.get(which)).is_some_and(|(hypothesis, values)| is_timing(hypothesis, values, period))
}

/// The figures of every finding of a search, for those who calibrate its confidence: effect, place, figures.
pub fn figures_of(search: &Search) -> Vec<(String, String, Figures)> {
    let best = chosen(search);
    let one = |(which, h): (usize, &Hypothesis)| {
        let rivals = rivals(search, best, which);
        let near: Vec<(&Hypothesis, &Candidate)> = rivals.iter().map(|(h, c, _)| (h, *c)).collect();
        (h.physics.name.to_string(), h.place.to_string(), figures(search, best, which, &near))
    };
    best.structure.added.iter().enumerate().map(one).collect()
}

fn finding(search: &Search, best: &Candidate, spread: &Uncertainty, which: usize) -> Finding {
    let hypothesis = &best.structure.added[which];
    let rivals = rivals(search, best, which);
    let near: Vec<(&Hypothesis, &Candidate)> = rivals.iter().map(|(h, c, _)| (h, *c)).collect();
    let figures = figures(search, best, which, &near);
    let on_forces = search.forces.as_ref().and_then(|forces| forces.beliefs.iter().find(|(id, _)| *id == hypothesis.id));
    let (confidence, of_family) = match on_forces {
        Some((_, belief)) => (belief.law, belief.kind),
        None => (probability(&figures), probability_of_family(&figures)),
    };
    // What is left of the probability goes to the rivals that were fitted, the more the nearer they come, and to what was not.
    let weights: Vec<f64> = rivals.iter().map(|(_, _, behind)| (-behind.max(0.0) / tuning().claim.softened).exp()).collect();
    let sum = 1.0 + weights.iter().sum::<f64>();
    let alternative = |((rival, _, _), weight): (&(Hypothesis, &Candidate, f64), &f64)| Alternative {
        physics: rival.physics.name.to_string(),
        place: rival.place.clone(),
        confidence: round_significant((1.0 - confidence) * weight / sum, 3),
    };
    Finding {
        physics: hypothesis.physics.name.to_string(),
        place: hypothesis.place.clone(),
        parameters: parameters_of(best, spread, which),
        replaces: hypothesis.replaces.clone(),
        confidence: round_significant(confidence, 3),
        family: Some(hypothesis.physics.family),
        family_confidence: round_significant(of_family.max(confidence), 3),
        alternatives: rivals.iter().zip(&weights).take(tuning().claim.alternatives).map(alternative).collect(),
        closed_loop: None,
    }
}

/// A finding with rivals is not certain: the probability that it or one of its rivals is right is shared among them by how near they come.
pub(crate) fn share_with_rivals(search: &Search, best: &Candidate, rivals: &[&Candidate], findings: &mut [Finding]) {
    if search.forces.is_some() {
        return; // the beliefs contain the rivals already
    }
    let weight = |c: &Candidate| (-behind(search, c, best).max(0.0) / tuning().claim.softened).exp();
    for finding in findings {
        let is_it = |h: &Hypothesis| h.physics.name == finding.physics && h.place.same(&finding.place);
        let Some(own) = best.structure.added.iter().find(|h| is_it(h)) else { continue };
        let against: Vec<&Candidate> = rivals.iter().copied().filter(|c| exchanged(best, c).0.iter().any(|h| h.id == own.id)).collect();
        let others: f64 = against.iter().map(|c| weight(c)).sum();
        // Of its kind are laws at its place; a law at another place, or of another kind, takes a share of the family's probability.
        let is_of_its_kind =
            |c: &&&Candidate| exchanged(best, c).1.iter().all(|h| h.place.same(&finding.place) && Some(h.physics.family) == finding.family);
        let other_kinds: f64 = against.iter().filter(|c| !is_of_its_kind(c)).map(|c| weight(c)).sum();
        let shared = 1.0 / (1.0 + other_kinds);
        let all = finding.confidence + finding.alternatives.iter().map(|a| a.confidence).sum::<f64>();
        let (before, after) = (finding.confidence, all.min(1.0) / (1.0 + others));
        finding.family_confidence = round_significant(finding.family_confidence.min(shared).max(after.min(before)), 3);
        if others == 0.0 || after >= before {
            continue;
        }
        finding.confidence = round_significant(after, 3);
        // What it loses goes to those.
        for rival in against {
            for h in exchanged(best, rival).1 {
                let share = round_significant((before - after) * weight(rival) / others, 3);
                match finding.alternatives.iter_mut().find(|a| a.physics == h.physics.name && a.place.same(&h.place)) {
                    Some(there) => there.confidence = round_significant((there.confidence + share).min(finding.confidence), 3),
                    None => finding.alternatives.push(Alternative {
                        physics: h.physics.name.to_string(),
                        place: h.place.clone(),
                        confidence: share,
                    }),
                }
            }
        }
        finding.alternatives.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    }
}

/// The alternative to one hypothesis in structures that are otherwise the same, its structure, and how far it is behind.
fn rivals<'s>(search: &'s Search, best: &Candidate, which: usize) -> Vec<(Hypothesis, &'s Candidate, f64)> {
    let own = &best.structure.added[which];
    let others: Vec<&str> = best.structure.added.iter().filter(|h| h.id != own.id).map(|h| h.id.as_str()).collect();
    let mut found: Vec<(Hypothesis, &Candidate, f64)> = Vec::new();
    for candidate in search.found.iter().filter(|c| c.structure.added.len() == best.structure.added.len()) {
        let added = &candidate.structure.added;
        let rest: Vec<&Hypothesis> = added.iter().filter(|h| !others.contains(&h.id.as_str())).collect();
        let [rival] = rest.as_slice() else { continue };
        if rival.id != own.id && added.len() - 1 == others.len() {
            found.push(((*rival).clone(), candidate, evidence(search, candidate, best)));
        }
    }
    found.sort_by(|a, b| a.2.total_cmp(&b.2));
    // However finely a law is resolved, it is one effect.
    let same = |a: &Hypothesis, b: &Hypothesis| a.physics == b.physics && a.place.same(&b.place);
    let mut each: Vec<(Hypothesis, &Candidate, f64)> = Vec::new();
    for (rival, candidate, behind) in found {
        if !same(&rival, own) && !each.iter().any(|(other, _, _)| same(&rival, other)) {
            each.push((rival, candidate, behind));
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
        let ci95 = spread.one_sided(best, index).map(|end| end.and_then(|end| rounded(end, 5)));
        let unit = parameter.unit.clone();
        if parameter.index.is_some() {
            let none = || Parameter::List(Estimates { value: Vec::new(), ci95: Vec::new(), unit });
            if let Parameter::List(list) = all.entry(parameter.key.clone()).or_insert_with(none) {
                list.value.push(value);
                list.ci95.push(ci95);
            }
        } else {
            all.insert(
                parameter.key.clone(),
                Parameter::One(Estimate { value, ci95, at_bound: number.at_bound(best.fit.values[index]).is_some(), unit }),
            );
        }
    }
    all
}

/// Parameters of the nominal model as the fit has them, by their path.
pub(crate) fn moved(problem: &Problem, best: &Candidate, spread: &Uncertainty) -> BTreeMap<String, Moved> {
    let mut all = BTreeMap::new();
    for (index, number) in best.structure.free.iter().enumerate() {
        let Role::Stated(i) = number.role else { continue };
        let (stated, value) = (&problem.stated[i], best.fit.values[index]);
        let list = problem.stated.iter().filter(|s| s.path == stated.path).count() > 1;
        let key = if list { format!("{}[{}]", stated.path, stated.index) } else { stated.path.clone() };
        let away = (number.to_internal(value) - number.to_internal(stated.given)) / spread.deviation[index];
        let moved = Moved {
            value: round_significant(value, 5),
            ci95: spread.one_sided(best, index).map(|end| end.and_then(|end| rounded(end, 5))),
            nominal: stated.given,
            moved_sd: rounded(away, 3),
        };
        all.insert(key, moved);
    }
    all
}

/// What would have been seen: for each effect the smallest size at the place where it shows best.
pub(crate) fn detectable(search: &Search) -> Vec<Detectable> {
    let one = |d: &crate::search::Detectable| Detectable {
        physics: d.physics.to_string(),
        place: d.place.clone(),
        unit: d.unit.to_string(),
        size: BTreeMap::from([(d.key.clone(), round_significant(d.size, 3))]),
    };
    search.detectable.iter().map(one).collect()
}
