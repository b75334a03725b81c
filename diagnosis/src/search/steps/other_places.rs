//! The law that was found, at other places.

use super::near::brought_near;
use super::step::{Step, Terms};
use crate::hypothesis::{Family, Hypothesis, Parameter, Place};
use crate::output_error::candidate::{Candidate, key_of, simplest};
use crate::output_error::evaluator::Evaluator;
use crate::search::race::{Course, Seed};
use crate::search::state::State;
use crate::tuning::tuning;
use backdrive_plant::model::Model;

/// The place where a law was found at first may be a neighbour of its own.
pub(crate) struct OtherPlaces;

impl Step for OtherPlaces {
    fn name(&self) -> &'static str {
        "fitting the same law at other places"
    }

    fn terms(&self) -> Terms {
        Terms::rivals()
    }

    fn is_for_rivals(&self, _: &State) -> bool {
        true
    }

    fn is_wanted(&self, state: &State) -> bool {
        state.may_be_claimed() && law(state) != state.moved_about
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        state.moved_about = law(state);
        let course = state.course;
        let Some(best) = simplest(&state.found, state.samples()) else { return Vec::new() };
        let mut seeds = elsewhere(&course, best);
        if !state.is_done() {
            seeds.extend(shared(&course, best));
        }
        // What stands in another place asks for other parameters all around: some steps with patience, before it is held against one that is at its end. And where
        // the stated parameters were right, the refit without the effect has led away from them: so from there, too, in its own place as well.
        let problem = course.evaluator.problem;
        let records = course.beginnings(&best.fit.residuals).records(course.evaluator);
        let budget = course.evaluator.budget.next(state.work.share(tuning().search.share_of_elsewhere));
        let coarse = Evaluator { substeps: course.coarse, records: &records, budget, ..course.evaluator.clone() };
        let itself =
            Seed::beside(problem, (&best.structure, &best.fit.values), course.effects_of(&best.structure, &best.fit.values), false);
        let anew = seeds.iter().chain(std::iter::once(&itself)).map(|seed| Seed { stated: course.given.to_vec(), ..seed.clone() });
        let near = brought_near(&course, &coarse, seeds.iter().cloned().chain(anew).collect());
        seeds.into_iter().chain(near).collect()
    }
}

/// The law that is moved about.
fn law(state: &State) -> String {
    simplest(&state.found, state.samples()).map_or_else(String::new, |c| key_of(&c.structure.added))
}

/// Each effect with its values at every other place where that effect may act. To first order neighbours that are firmly joined do the same, and screening,
/// or a coupled fit, may have confused the two.
fn elsewhere(course: &Course, best: &Candidate) -> Vec<Seed> {
    let own = course.effects_of(&best.structure, &best.fit.values);
    let mut seeds = Vec::new();
    for (slot, (effect, values)) in best.structure.added.iter().zip(best.structure.added_of(&best.fit.values)).enumerate() {
        let beside = |h: &Hypothesis| best.structure.added.iter().enumerate().all(|(i, other)| i == slot || other.compatible(h));
        for (index, h) in course.hypotheses.iter().enumerate() {
            if h.physics != effect.physics || h.place.same(&effect.place) || !beside(h) {
                continue;
            }
            let alike = h.parameters.len() == values.len() && h.parameters.iter().zip(&effect.parameters).all(|(a, b)| a.unit == b.unit);
            let carried: Vec<f64> = h.parameters.iter().zip(&values).map(|(p, v)| v.clamp(p.range.0, p.range.1)).collect();
            let start = if alike { Some(carried) } else { h.starts.first().cloned() };
            let Some(start) = start else { continue };
            let mut effects = own.clone();
            if let Some(place) = effects.get_mut(slot) {
                *place = (index, start);
                seeds.push(Seed::beside(course.evaluator.problem, (&best.structure, &best.fit.values), effects, false));
            }
        }
    }
    seeds
}

/// Friction of one body shared with a body that an element joins to it, half of the force at each. Below their resonance both together do what one does, so
/// that friction of two bodies is first found as friction of one.
fn shared(course: &Course, best: &Candidate) -> Vec<Seed> {
    let problem = course.evaluator.problem;
    let own = course.effects_of(&best.structure, &best.fit.values);
    let mut seeds = Vec::new();
    for (slot, effect) in best.structure.added.iter().enumerate() {
        let Some(body) = grounded(&effect.place).filter(|_| effect.physics.family == Family::Friction) else { continue };
        let neighbours = neighbours(&problem.model, body);
        let is_beside = |h: &Hypothesis| {
            h.physics == effect.physics
                && h.parameters.len() == effect.parameters.len()
                && grounded(&h.place).is_some_and(|other| neighbours.contains(&other))
                && best.structure.added.iter().all(|other| other.compatible(h))
        };
        for (index, h) in course.hypotheses.iter().enumerate().filter(|(_, h)| is_beside(h)) {
            let mut effects = own.clone();
            let Some((_, values)) = effects.get_mut(slot) else { continue };
            let force = |p: &Parameter| matches!(p.unit.as_str(), "N" | "N m");
            effect.parameters.iter().zip(values.iter_mut()).filter(|(p, _)| force(p)).for_each(|(p, v)| *v = (0.5 * *v).max(p.range.0));
            let half = h.parameters.iter().zip(values.iter()).map(|(p, v)| v.clamp(p.range.0, p.range.1)).collect();
            effects.push((index, half));
            seeds.push(Seed::beside(problem, (&best.structure, &best.fit.values), effects, false));
        }
    }
    seeds
}

/// The body of a law between it and the ground.
fn grounded(place: &Place) -> Option<&str> {
    match place {
        Place::Between(body, ground) | Place::Between(ground, body) if ground == "ground" => Some(body),
        Place::Between(..) | Place::Signal(_) => None,
    }
}

/// Bodies that an element joins to this one.
fn neighbours<'m>(model: &'m Model, body: &str) -> Vec<&'m str> {
    let name = |index: Option<usize>| index.and_then(|i| model.bodies.get(i)).map(|b| b.name.as_str());
    let other = |between: [Option<usize>; 2]| {
        let [a, b] = between.map(name);
        if a == Some(body) {
            b
        } else if b == Some(body) {
            a
        } else {
            None
        }
    };
    let mut all: Vec<&str> = model.elements.iter().filter_map(|e| other(e.between)).filter(|name| *name != body).collect();
    all.sort_unstable();
    all.dedup();
    all
}
