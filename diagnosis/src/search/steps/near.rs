//! Seeds that start far from where they belong, with the patience that the nominal model has at first.

use crate::effort::Effort;
use crate::evaluator::Evaluator;
use crate::race::{Course, Seed};
use crate::tuning::tuning;

/// Seeds fitted as the nominal model is at first: beside fits that begin where another one ended they would be dropped after their first steps. `coarse` holds
/// what they are fitted to.
pub(super) fn brought_near(course: &Course, coarse: &Evaluator, seeds: Vec<Seed>) -> Vec<Seed> {
    let problem = course.evaluator.problem;
    let effort = Effort { steps: tuning().fit.nominal_first[0], ..tuning().fit.early };
    let fitted = coarse.budget.abreast(&seeds, |budget, seed| {
        let (structure, start) = seed.begin(course, coarse.records);
        let fit = coarse.within(budget.clone()).fit(&structure, &start, effort)?;
        let effects = seed.effects.iter().map(|(h, _)| *h).zip(structure.added_of(&fit.values)).collect();
        Some(Seed { effects, stated: structure.stated_of(problem, &fit.values), ..seed.clone() })
    });
    fitted.into_iter().flatten().flatten().collect()
}
