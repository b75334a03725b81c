//! The law that was found, at other places.

use super::near::brought_near;
use super::step::{Step, Terms};
use crate::candidate::{Candidate, key_of, simplest};
use crate::evaluator::Evaluator;
use crate::hypothesis::Hypothesis;
use crate::race::{Course, Seed};
use crate::search::state::State;
use crate::tuning::tuning;

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
        let seeds = elsewhere(&course, best);
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
