//! Seeds that start far from where they belong, with the patience that the nominal model has at first.

use crate::output_error::effort::Effort;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::structure::Role;
use crate::search::race::{Course, Seed};
use crate::tuning::tuning;

/// Seeds fitted as the nominal model is at first: beside fits that begin where another one ended they would be dropped after their first steps. `coarse` holds
/// what they are fitted to. The effects alone go first: where the stated parameters were right, all at once would leave them again.
pub(super) fn brought_near(course: &Course, coarse: &Evaluator, seeds: Vec<Seed>) -> Vec<Seed> {
    let problem = course.evaluator.problem;
    let effort = Effort { steps: tuning().fit.nominal_first[0], ..tuning().fit.early };
    let fitted = coarse.budget.abreast(&seeds, |budget, seed| {
        let (structure, start) = seed.begin(course, coarse.records);
        let effects = structure.free.iter().map(|n| n.role.clone()).filter(|role| matches!(role, Role::Added(..))).collect();
        let alone = Evaluator { only: Some(effects), ..coarse.within(budget.clone()) };
        let begun = alone.fit(&structure, &start, Effort { steps: tuning().fit.effects_first, ..effort })?;
        let fit = coarse.within(budget.clone()).fit(&structure, &begun.values, effort)?;
        let effects = seed.effects.iter().map(|(h, _)| *h).zip(structure.added_of(&fit.values)).collect();
        Some(Seed { effects, stated: structure.stated_of(problem, &fit.values), ..seed.clone() })
    });
    fitted.into_iter().flatten().flatten().collect()
}
