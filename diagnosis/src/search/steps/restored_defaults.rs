//! Stated parameters that give back what they may have absorbed.

use super::step::{Step, Terms};
use crate::hypothesis::Place;
use crate::search::race::{Course, Seed};
use crate::search::screen::Promise;
use crate::search::state::State;
use crate::tuning::tuning;
use std::collections::HashSet;

/// A law next to a stated parameter of its kind in the neighbourhood. Its start re-initialises that parameter, which may have absorbed the effect.
pub(crate) struct RestoredDefaults;

impl Step for RestoredDefaults {
    fn name(&self) -> &'static str {
        "splitting parameters with a neighbour"
    }

    fn terms(&self) -> Terms {
        Terms { tries_again: true, ..Terms::effects() }
    }

    fn is_for_rivals(&self, _: &State) -> bool {
        true
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        // Near the noise, where what the parameters have absorbed is all that a law does.
        match state.views.first().filter(|_| !state.far) {
            Some(view) => given_back(&state.course, &view.simple, state.chance()),
            None => Vec::new(),
        }
    }
}

/// Laws of one parameter with a good screening value, next to a stated parameter of the same kind that has a body in common with them. That parameter is
/// re-initialised, because it may have absorbed the effect. A damper at a motor and one at the drum behind a stiff cable do nearly the same. A fit goes
/// from all at one to all at the other along a narrow valley, and not to its end. `chance` is the share that the best promises by chance.
fn given_back(course: &Course, promises: &[Promise], chance: f64) -> Vec<Seed> {
    let problem = course.evaluator.problem;
    let top = promises.first().map_or(0.0, |p| p.share);
    let (stated, of_records) = (
        course.nominal.structure.stated_of(problem, &course.nominal.fit.values),
        course.nominal.structure.of_records(&course.nominal.fit.values),
    );
    let mut used = HashSet::new();
    let mut seeds = Vec::new();
    for promise in promises.iter().filter(|p| p.share > chance.max(tuning().search.promise * top) && used.insert(p.hypothesis)) {
        let Some(law) = course.hypotheses.get(promise.hypothesis) else { continue };
        let (Place::Between(a, b), [parameter]) = (&law.place, law.parameters.as_slice()) else { continue };
        for element in problem.model.elements.iter().filter(|e| e.law.kind().name == law.physics.name) {
            let ends = element.between.map(|end| problem.model.place_name(end));
            let path = format!("elements.{}.{}", element.name, parameter.key);
            let own = problem.stated.iter().zip(&stated).enumerate().find(|(_, (s, _))| s.path == path);
            let Some((index, (number, value))) = own.filter(|_| ends.iter().any(|end| end == a || end == b)) else { continue };
            let moved = (value - number.given).max(0.0);
            for taken in tuning().search.taken_over.iter().map(|part| part * value).chain((moved > 0.0).then_some(moved)) {
                let mut stated = stated.clone();
                stated[index] = (value - taken).clamp(number.range.0, number.range.1);
                let values = vec![taken.clamp(parameter.range.0, parameter.range.1)];
                seeds.push(Seed {
                    effects: vec![(promise.hypothesis, values)],
                    stated,
                    of_records: of_records.clone(),
                    coupled_first: false,
                });
            }
        }
    }
    seeds
}
