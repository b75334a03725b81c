//! Simpler laws of the family of the best in its place, and, where residuals remain, laws that contain it.

use super::step::{Step, Terms};
use crate::hypothesis::{self, Hypothesis};
use crate::output_error::candidate::Candidate;
use crate::physics;
use crate::search::race::{Course, Seed};
use crate::search::state::State;

/// A law that wins with more parameters must be better than its simpler relatives, whatever their screening value. Far from the noise, where fits were cut
/// short, the first that came near may not be the right one.
pub(crate) struct Relatives;

impl Step for Relatives {
    fn name(&self) -> &'static str {
        "fitting simpler and richer laws of the same family"
    }

    fn terms(&self) -> Terms {
        Terms::rivals()
    }

    fn is_for_rivals(&self, _: &State) -> bool {
        true
    }

    fn is_wanted(&self, state: &State) -> bool {
        state.may_be_claimed() && state.related != state.best()
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        state.related = state.best();
        relatives(&state.course, &state.found, state.is_done())
    }
}

/// Simpler laws of the same family instead of each effect of the best. Where residuals remain, also laws that are as simple, and laws that contain it. An
/// effect of one joint is often found as its nearest simple law, and no other effect can be found while that law is in the structure.
fn relatives(course: &Course, found: &[Candidate], done: bool) -> Vec<Seed> {
    let Some(best) = found.first() else { return Vec::new() };
    let own = course.effects_of(&best.structure, &best.fit.values);
    let mut seeds = Vec::new();
    for (out, (effect, values)) in best.structure.added.iter().zip(best.structure.added_of(&best.fit.values)).enumerate() {
        let relative = |h: &Hypothesis| {
            let is_simple =
                h.physics.family == effect.physics.family && h.parameters.len() < effect.parameters.len() + if done { 0 } else { 2 };
            let is_richer = !done && physics::contains(h.physics, effect.physics);
            // A load behind a compliance and one behind a play hang on the same body, and have other names.
            let is_here = h.place.same(&effect.place) || hypothesis::refined(effect, &values, h).is_some();
            is_here && h.id != effect.id && (is_simple || is_richer)
        };
        for (index, h) in course.hypotheses.iter().enumerate().filter(|(_, h)| relative(h)) {
            let starts =
                hypothesis::refined(effect, &values, h).map_or_else(|| hypothesis::starts_beside(effect, &values, h), |start| vec![start]);
            for start in starts {
                let mut effects = own.clone();
                if let Some(slot) = effects.get_mut(out) {
                    *slot = (index, course.with_replaced((&best.structure, &best.fit.values), h, start));
                    seeds.push(Seed::beside(course.evaluator.problem, (&best.structure, &best.fit.values), effects, false));
                }
            }
        }
    }
    seeds
}
