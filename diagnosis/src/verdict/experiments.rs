//! The next experiment, where the verdict asks for one.

use super::choice::nearest;
use super::decision::Decision;
use super::rounded::rounded;
use super::types::{NextExperiment, Planned, Refused, Word};
use crate::experiment::{Experiment, Reason, excite, separate};
use crate::problem::Problem;
use crate::search::Search;
use crate::work::Budget;

/// Name of the file of the next experiment.
pub const EXPERIMENT_FILE: &str = "next-experiment.toml";

/// What would tell rivals apart or move the device, or why nothing would, and the excitation file; looked for with this budget.
pub(super) fn next_experiment<'a>(
    problem: &'a Problem,
    search: &Search,
    decision: &Decision,
    budget: &Budget<'a>,
) -> (Option<NextExperiment>, Option<String>) {
    match planned(problem, search, decision, budget) {
        Some(Ok(plan)) => (Some(NextExperiment::Planned(in_file(&plan))), Some(plan.text)),
        Some(Err(reason)) => (Some(NextExperiment::Refused(Refused { sentence: reason.to_string() })), None),
        None => (None, None),
    }
}

fn planned<'a>(problem: &'a Problem, search: &Search, decision: &Decision, budget: &Budget<'a>) -> Option<Result<Experiment, Reason>> {
    let best = decision.best;
    match decision.word {
        Word::Ambiguous => {
            let rivals = if decision.alike.is_empty() { nearest(search, best) } else { decision.alike.clone() };
            Some(separate(problem, &[&[best], rivals.as_slice()].concat(), &search.noise_sd, budget))
        }
        Word::CannotTell => best.structure.model(problem, &best.fit.values).map(|model| {
            let all: Vec<usize> = (0..best.structure.free.len()).collect();
            excite(problem, &model, &best.structure, &best.fit.values, &all, &search.noise_sd, budget)
        }),
        Word::Missing | Word::Parameters | Word::NothingMissing | Word::Unexplained => None,
    }
}

/// An experiment as the verdict has it; its file is written under [`EXPERIMENT_FILE`].
fn in_file(plan: &Experiment) -> Planned {
    Planned {
        file: EXPERIMENT_FILE.to_string(),
        input: plan.input.clone(),
        excitation: plan.excitation.clone(),
        sentence: plan.sentence.clone(),
        between: plan.between.clone(),
        separation_sd: rounded(plan.separation, 3),
        level_floors: rounded(plan.level, 3),
        output: plan.output.clone(),
        repeats: plan.repeats,
        duration_s: rounded(plan.duration, 6),
        rate_hz: plan.rate_hz,
    }
}
