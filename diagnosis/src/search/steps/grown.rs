//! One effect after the other, each screened beside those that were found: for a device whose motion is known, so that effects add up in its force.

use super::beside_the_best::BesideTheBest;
use super::step::{Race, Step, Terms};
use crate::search::race::Seed;
use crate::search::state::State;
use crate::search::view;

/// Along a measured motion what one effect leaves shows the next, and ripples alone once friction and resonances no longer hide them.
pub(crate) struct Grown;

impl Step for Grown {
    fn name(&self) -> &'static str {
        "screening one more effect beside the best"
    }

    fn terms(&self) -> Terms {
        Terms { race: Race::Free, ..Terms::effects() }
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        state.effects += 1;
        let mut seeds = ripples(state);
        seeds.extend(BesideTheBest.propose(state));
        seeds
    }
}

/// The best with each ripple that stands alone in the force which it leaves.
fn ripples(state: &State) -> Vec<Seed> {
    let (course, problem) = (state.course, state.course.evaluator.problem);
    let Some(best) = state.found.iter().find(|c| c.structure.added.len() + 1 == state.effects) else { return Vec::new() };
    let Some(model) = best.structure.model(problem, &best.fit.values) else { return Vec::new() };
    let records = best.structure.with_unknown(problem, &problem.fit, &best.fit.values);
    let mut hypotheses = course.hypotheses.to_vec();
    let own = course.effects_of(&best.structure, &best.fit.values);
    let beside =
        |ripple: (usize, Vec<f64>)| Seed::beside(problem, (&best.structure, &best.fit.values), [own.clone(), vec![ripple]].concat(), false);
    let is_new = |(index, _): &(usize, Vec<f64>)| {
        course.hypotheses.get(*index).is_some_and(|h| best.structure.added.iter().all(|own| own.id != h.id && own.compatible(h)))
    };
    view::ripples(&records, &model, &course.evaluator.noise_sd, &mut hypotheses).into_iter().filter(is_new).take(2).map(beside).collect()
}
