//! What was found: each physics with its place, its numbers, and what else could stand there.

use super::choice::{contains, evidence};
use crate::hypothesis::{Hypothesis, Place};
use crate::intervals::Spread;
use crate::problem::Problem;
use crate::search::{Candidate, Search};
use crate::structure::Role;
use backdrive_plant::write::round_significant;
use serde_json::{Value as Json, json};

/// Level and correlation time (samples) up to which what is left over is measuring error beyond doubt.
const NOISE_LEVEL: f64 = 1.05;
/// See [`NOISE_LEVEL`].
const NOISE_MEMORY: f64 = 1.2;

/// How far what is left over is measuring error: 1 where it has its size and hangs together no more than it, less the more of either. A law
/// that only imitates what is there leaves a little over, and that little is not white.
pub(super) fn adequacy(best: &Candidate) -> f64 {
    let level = best.levels.iter().fold(0.0f64, |a, b| a.max(*b));
    let size = (-(level - NOISE_LEVEL).max(0.0) / 0.15).exp();
    let whiteness = (-(best.correlation_time - NOISE_MEMORY).max(0.0) / 1.5).exp();
    (size * whiteness).max(0.05)
}

pub(super) fn findings(search: &Search, best: &Candidate, spread: &Spread, adequacy: f64) -> Vec<Json> {
    let total = best.structure.added.len();
    let mut all: Vec<(f64, Json)> = Vec::new();
    for (h, hypothesis) in best.structure.added.iter().enumerate() {
        let rivals = rivals(search, best, h);
        // The weight of each, softened: a simulator is never the device.
        // A richer law at the same place that fits no better is the same law.
        let nested = |rival: &Hypothesis| rival.place.same(&hypothesis.place) && contains(rival.physics, hypothesis);
        let weight = |(rival, behind): &(Hypothesis, f64)| (-behind.max(0.0) / 20.0).exp() * if nested(rival) { 0.1 } else { 1.0 };
        let weights: Vec<f64> = rivals.iter().map(weight).collect();
        // And of those that promised as much, but were not fitted: little, for they did not win their race.
        let own = search.tried.iter().find(|t| t.id == hypothesis.id).map_or(1.0, |t| t.promised);
        let unfitted = search.tried.iter().filter(|t| t.taken.is_none() && t.promised > 0.9 * own).count() as f64;
        let sum = 1.0 + weights.iter().sum::<f64>() + 0.02 * unfitted.min(10.0);
        let alternatives: Vec<Json> = rivals
            .iter()
            .zip(&weights)
            .take(6)
            .map(|((rival, _), weight)| {
                let mut entry = place(&rival.place);
                entry["physics"] = json!(rival.physics.name);
                entry["confidence"] = json!(round_significant(weight / sum, 3));
                entry
            })
            .collect();
        let mut entry = place(&hypothesis.place);
        entry["physics"] = json!(hypothesis.physics.name);
        entry["parameters"] = parameters_of(best, spread, h);
        entry["replaces"] = json!(hypothesis.replaces);
        entry["confidence"] = json!(round_significant(adequacy / sum, 3));
        entry["alternatives"] = json!(alternatives);
        // What the cost would be without it tells how important it is.
        let without = search
            .found
            .iter()
            .filter(|c| {
                c.structure.added.len() + 1 == total
                    && c.structure.added.iter().all(|o| o.id != hypothesis.id && best.structure.added.iter().any(|b| b.id == o.id))
            })
            .map(|c| c.fit.cost)
            .fold(search.nominal.fit.cost, f64::min);
        all.push((without, entry));
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().map(|(_, entry)| entry).collect()
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
    // However finely a law is drawn, it is one physics.
    let same = |a: &Hypothesis, b: &Hypothesis| a.physics == b.physics && a.place.same(&b.place);
    let mut each: Vec<(Hypothesis, f64)> = Vec::new();
    for (rival, behind) in found {
        if !same(&rival, own) && !each.iter().any(|(other, _)| same(&rival, other)) {
            each.push((rival, behind));
        }
    }
    each
}

pub(super) fn place(place: &Place) -> Json {
    match place {
        Place::Between(a, b) => json!({ "between": [a, b] }),
        Place::Signal(name) => json!({ "signal": name }),
    }
}

fn parameters_of(best: &Candidate, spread: &Spread, which: usize) -> Json {
    let hypothesis = &best.structure.added[which];
    let mut all = serde_json::Map::new();
    for (index, number) in best.structure.numbers.iter().enumerate() {
        let Role::Added(h, p) = number.role else { continue };
        let Some(parameter) = hypothesis.parameters.get(p).filter(|_| h == which) else { continue };
        let (value, [low, high]) = (best.fit.values[index], spread.interval(best, index));
        let r = |x: f64| json!(round_significant(x, 5));
        if parameter.index.is_some() {
            let entry = all.entry(parameter.key.clone()).or_insert_with(|| json!({ "value": [], "ci95": [], "unit": parameter.unit }));
            for (key, x) in [("value", r(value)), ("ci95", json!([r(low), r(high)]))] {
                if let Some(list) = entry.get_mut(key).and_then(Json::as_array_mut) {
                    list.push(x);
                }
            }
        } else {
            all.insert(parameter.key.clone(), json!({ "value": r(value), "ci95": [r(low), r(high)], "unit": parameter.unit }));
        }
    }
    Json::Object(all)
}

pub(super) fn moved(problem: &Problem, best: &Candidate, spread: &Spread) -> Json {
    let mut all = serde_json::Map::new();
    for (index, number) in best.structure.numbers.iter().enumerate() {
        let Role::Stated(i) = number.role else { continue };
        let (stated, value, [low, high]) = (&problem.stated[i], best.fit.values[index], spread.interval(best, index));
        let r = |x: f64| json!(round_significant(x, 5));
        let list = problem.stated.iter().filter(|s| s.path == stated.path).count() > 1;
        let key = if list { format!("{}[{}]", stated.path, stated.index) } else { stated.path.clone() };
        let deviation = spread.deviation[index];
        let away = (number.inward(value) - number.inward(stated.given)) / deviation;
        all.insert(
            key,
            json!({ "value": r(value), "ci95": [r(low), r(high)], "nominal": stated.given, "moved_sd": round_significant(away, 3) }),
        );
    }
    Json::Object(all)
}

/// What would have been seen: for each physics the smallest size at the place where it shows best.
pub(super) fn detectable(search: &Search) -> Json {
    let one = |d: &crate::search::Detectable| {
        let mut entry = place(&d.place);
        entry["physics"] = json!(d.physics);
        entry[&d.key] = json!(round_significant(d.size, 3));
        entry["unit"] = json!(d.unit);
        entry
    };
    json!(search.detectable.iter().map(one).collect::<Vec<Json>>())
}
