//! Laws of the best, resolved more finely.

use super::step::{Step, Terms};
use crate::hypothesis;
use crate::output_error::candidate::{Candidate, distinct_structures};
use crate::search::race::{Course, Seed};
use crate::search::state::State;
use crate::tuning::tuning;

/// The resolution of a law is no effect of its own: that comes before another effect.
pub(crate) struct Finer;

impl Step for Finer {
    fn name(&self) -> &'static str {
        "refining the discretisation of a law"
    }

    fn terms(&self) -> Terms {
        Terms::forms_of_the_best(tuning().search.share_of_finer)
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        finer(&state.course, &state.found)
    }
}

/// The best, and what does nearly as well with as many effects, with a law of theirs resolved more finely.
fn finer(course: &Course, found: &[Candidate]) -> Vec<Seed> {
    let Some(best) = found.first() else { return Vec::new() };
    let near = |c: &&Candidate| c.fit.cost < tuning().search.behind * best.fit.cost;
    let mut seeds = Vec::new();
    for c in distinct_structures(found, best.structure.added.len()).filter(near) {
        let own = course.effects_of(&c.structure, &c.fit.values);
        for (slot, (effect, values)) in c.structure.added.iter().zip(c.structure.added_of(&c.fit.values)).enumerate() {
            for (index, h) in course.hypotheses.iter().enumerate() {
                let Some(start) = hypothesis::refined(effect, &values, h) else { continue };
                let mut effects = own.clone();
                if let Some(place) = effects.get_mut(slot) {
                    *place = (index, start);
                    seeds.push(Seed::beside(course.evaluator.problem, (&c.structure, &c.fit.values), effects, false));
                }
            }
        }
    }
    seeds
}
