//! One effect of the best exchanged for another: a first step may have been the wrong one.

use super::extensions::extensions;
use super::step::Step;
use crate::hypothesis::Hypothesis;
use crate::output_error::candidate::{Candidate, candidate};
use crate::output_error::structure::Structure;
use crate::search::race::{Course, Seed};
use crate::search::state::State;
use crate::search::view::View;
use crate::tuning::tuning;

/// Each effect of the best exchanged for what promises most in its place.
pub(crate) struct Exchanges;

impl Step for Exchanges {
    fn name(&self) -> &'static str {
        "exchanging effects"
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        let Some(view) = state.views.first() else { return Vec::new() };
        let best = state.found.iter().find(|c| c.structure.added.len() == state.effects);
        best.map_or_else(Vec::new, |best| exchanges(&state.course, view, best, 4))
    }
}

/// A structure with each of its effects exchanged for what promises most in its place.
fn exchanges(course: &Course, view: &View, best: &Candidate, count: usize) -> Vec<Seed> {
    let problem = course.evaluator.problem;
    let stated = best.structure.stated_of(problem, &best.fit.values);
    let values = best.structure.added_of(&best.fit.values);
    let of_records = best.structure.of_records(&best.fit.values);
    let mut seeds = Vec::new();
    for out in 0..best.structure.added.len() {
        let keep = |i: &usize| *i != out;
        let added: Vec<Hypothesis> = (0..values.len()).filter(keep).map(|i| best.structure.added[i].clone()).collect();
        let kept: Vec<Vec<f64>> = (0..values.len()).filter(keep).map(|i| values[i].clone()).collect();
        let structure = Structure::new(problem, &problem.fit, added);
        let start = structure.values(problem, &stated, &kept, &of_records);
        let Some(fit) = view.evaluator.fit(&structure, &start, tuning().fit.early) else { continue };
        seeds.extend(extensions(course, view, &candidate(&view.evaluator, structure, fit), count));
    }
    seeds
}
