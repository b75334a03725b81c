//! What was found, beside the stated parameters as given.

use super::near::brought_near;
use super::step::{Step, Terms};
use crate::output_error::candidate::Candidate;
use crate::output_error::evaluator::Evaluator;
use crate::search::race::Seed;
use crate::search::state::State;
use crate::tuning::tuning;

/// The refit of an incomplete model moves stated parameters away from right values. An effect found with those values may end in another local minimum, or
/// a richer law may replace it. So the nearest are also fitted from the parameters as given.
pub(crate) struct FromNominal;

impl Step for FromNominal {
    fn name(&self) -> &'static str {
        "fitting with the nominal parameters"
    }

    fn terms(&self) -> Terms {
        Terms { share: 2.0 * tuning().search.share_of_elsewhere, ..Terms::rivals() }
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        let course = state.course;
        let problem = course.evaluator.problem;
        let Some(best) = state.found.first() else { return Vec::new() };
        let records = course.beginnings(&best.fit.residuals).records(course.evaluator);
        let budget = course.evaluator.budget.next(state.work.share(tuning().search.share_of_elsewhere));
        let coarse = Evaluator { substeps: course.coarse, records: &records, budget, ..course.evaluator.clone() };
        let as_given = |c: &Candidate| {
            let effects = course.effects_of(&c.structure, &c.fit.values);
            Seed { stated: course.given.to_vec(), ..Seed::beside(problem, (&c.structure, &c.fit.values), effects, false) }
        };
        let near = |c: &&Candidate| c.fit.cost < tuning().search.behind_far * best.fit.cost;
        let count = if state.leaves_much() { tuning().search.from_the_given_far } else { tuning().search.from_the_given };
        brought_near(&course, &coarse, state.found.iter().filter(near).take(count).map(as_given).collect())
    }
}
