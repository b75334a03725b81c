//! The next experiment, or why none would help.

use super::choice::nearest;
use super::decision::Decision;
use super::remaining::next_effect;
use super::rounded::rounded;
use super::types::{NextExperiment, Planned, Refused, Word};
use crate::candidate::Candidate;
use crate::experiment::{Experiment, Reason, excite, separate};
use crate::problem::Problem;
use crate::search::Search;
use crate::work::Budget;

/// Name of the file of the next experiment.
pub const EXPERIMENT_FILE: &str = "next-experiment.toml";

/// What would tell rivals apart, confirm what remains, determine numbers or move the device, or why nothing would, and the excitation file; looked for
/// with this budget.
pub(super) fn next_experiment<'a>(
    problem: &'a Problem,
    search: &Search,
    decision: &Decision,
    budget: &Budget<'a>,
) -> (Option<NextExperiment>, Option<String>) {
    match planned(problem, search, decision, budget) {
        Ok(plan) => (Some(NextExperiment::Planned(in_file(&plan))), Some(plan.text)),
        Err(reason) => (Some(NextExperiment::Refused(Refused { sentence: reason.to_string() })), None),
    }
}

fn planned<'a>(problem: &'a Problem, search: &Search, decision: &Decision, budget: &Budget<'a>) -> Result<Experiment, Reason> {
    let best = decision.best;
    let apart = |rivals: &[&Candidate]| separate(problem, &[&[best], rivals].concat(), &search.noise_sd, budget);
    match decision.word {
        Word::Ambiguous if decision.alike.is_empty() => apart(&nearest(search, best)),
        Word::Ambiguous => apart(&decision.alike),
        Word::CannotTell => determine(problem, search, best, budget),
        // Where something remains, what resembles it most is to be confirmed or ruled out; else what is not well known yet is to be measured.
        Word::Missing | Word::Unexplained | Word::Parameters | Word::NothingMissing => match next_effect(search, best) {
            Some(more) if !decision.at_floor => apart(&[more]),
            _ => determine(problem, search, best, budget).map_err(|reason| match decision.at_floor {
                true => Reason(format!("{reason}: nothing more has to be recorded for this model")),
                false => reason,
            }),
        },
    }
}

/// The experiment that determines what the recordings leave open.
fn determine<'a>(problem: &'a Problem, search: &Search, best: &Candidate, budget: &Budget<'a>) -> Result<Experiment, Reason> {
    let model = best.structure.model(problem, &best.fit.values).ok_or_else(|| Reason("the model cannot be simulated".to_string()))?;
    let all: Vec<usize> = (0..best.structure.free.len()).collect();
    excite(problem, &model, &best.structure, &best.fit.values, &all, &search.noise_sd, budget)
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
