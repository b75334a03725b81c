//! A structure with one effect more.

use crate::output_error::candidate::Candidate;
use crate::search::race::{Course, Seed};
use crate::search::screen::Promise;
use crate::search::view::View;
use crate::tuning::tuning;
use std::collections::HashSet;

/// A structure with each of what promises most beside it added.
pub(super) fn extensions(course: &Course, view: &View, base: &Candidate, count: usize) -> Vec<Seed> {
    let problem = course.evaluator.problem;
    let fit = if view.whole { Some(base.fit.clone()) } else { view.evaluator.fit(&base.structure, &base.fit.values, tuning().fit.early) };
    let Some(fit) = fit else { return Vec::new() };
    let fits = |h: usize| {
        let new = &course.hypotheses[h];
        new.parameters.len() <= tuning().screening.parameters && base.structure.added.iter().all(|b| b.compatible(new))
    };
    let own = course.effects_of(&base.structure, &fit.values);
    let seed = |p: Promise, coupled_first| {
        Seed::beside(problem, (&base.structure, &fit.values), [own.clone(), vec![(p.hypothesis, p.values)]].concat(), coupled_first)
    };
    let mut used = HashSet::new();
    let next = view.screen.look(&fit, &fits).into_iter().filter(|p| used.insert(p.hypothesis));
    next.take(count).map(|p| seed(p, view.coupled_first)).collect()
}
