//! The next experiment, or why none would help.

use super::remaining::next_effect;
use super::rounded::rounded;
use super::types::{Finding, NextExperiment, Planned, Refused, Sensor, Word};
use crate::belief::choice::{exchanged, nearest, richer};
use crate::belief::decision::Decision;
use crate::belief::intervals::NORMAL_975;
use crate::experiment::{Experiment, NewSensor, Reason, confirm, excite, separate};
use crate::output_error::candidate::Candidate;
use crate::output_error::observed::recorded;
use crate::output_error::work::Budget;
use crate::recordings::problem::Problem;
use crate::search::Search;

/// Name of the file of the next experiment.
pub const EXPERIMENT_FILE: &str = "next-experiment.toml";

/// The experiment that would separate rivals, confirm what remains, determine parameters or move the device, or why none would, and the excitation file.
/// The search for it has this budget. It completes the decision: two explanations are ambiguous where an experiment separates them.
pub(super) fn next_experiment<'a, 's>(
    problem: &'a Problem,
    search: &'s Search,
    decision: &mut Decision<'s>,
    budget: &Budget<'a>,
) -> (Option<NextExperiment>, Option<String>) {
    // An experiment is played on the device, beside which there is no observer.
    match planned(recorded(problem), search, decision, budget) {
        Ok(plan) => (Some(NextExperiment::Planned(in_file(&plan))), Some(plan.text)),
        Err(reason) => (Some(NextExperiment::Refused(Refused { sentence: reason.to_string() })), None),
    }
}

fn planned<'a, 's>(
    problem: &'a Problem,
    search: &'s Search,
    decision: &mut Decision<'s>,
    budget: &Budget<'a>,
) -> Result<Experiment, Reason> {
    let best = decision.best;
    let apart = |rivals: &[&Candidate]| separate(problem, &[&[best], rivals].concat(), &search.noise_sd, budget);
    let mut inseparable = None;
    if decision.word == Word::Ambiguous {
        let rivals = if decision.alike.is_empty() { nearest(search, best) } else { decision.alike.clone() };
        match apart(&rivals) {
            Ok(plan) => {
                decision.alike = rivals;
                return Ok(plan);
            }
            Err(reason) => {
                // Where all say the same of the kind of physics and of its place, that is said; else nobody can tell.
                let is_known = decision.findings.iter().any(Finding::is_sure);
                decision.word = match rivals.iter().all(|c| is_kin(best, c)) {
                    true => Word::Missing,
                    false if is_known => Word::Ambiguous,
                    false => Word::CannotTell,
                };
                inseparable = Some(reason);
            }
        }
    }
    if decision.word == Word::Missing || inseparable.is_some() {
        // Of laws that contain one another the simpler is claimed as long as there is no evidence against it, and the experiment is to rule the richer one
        // out. A law of more parameters that is another explanation leaves it open.
        let (contained, others): (Vec<_>, Vec<_>) = richer(search, best).into_iter().partition(|rival| rival.contains);
        for rival in others.into_iter().chain(contained) {
            if let Ok(plan) = confirm(problem, [best, rival.candidate], rival.contains, &search.noise_sd, budget) {
                if !rival.contains {
                    (decision.word, decision.alike) = (Word::Ambiguous, vec![rival.candidate]);
                }
                return Ok(plan);
            }
        }
    }
    if let Some(reason) = inseparable {
        return Err(reason);
    }
    match decision.word {
        Word::Ambiguous | Word::CannotTell => determine(problem, search, decision, budget),
        // Where something remains, what resembles it most is to be confirmed or ruled out; else what is not well known yet is to be measured.
        Word::Missing | Word::Unexplained | Word::Parameters | Word::NothingMissing => match next_effect(search, best) {
            Some(more) if !decision.at_floor => apart(&[more]),
            _ => determine(problem, search, decision, budget).map_err(|reason| match decision.at_floor {
                true => Reason(format!("{reason}: no further recording is needed for this model")),
                false => reason,
            }),
        },
    }
}

/// Whether two structures differ in laws of one family in the same places alone.
fn is_kin(best: &Candidate, other: &Candidate) -> bool {
    let (own, rest) = exchanged(best, other);
    own.len() == rest.len() && own.iter().all(|h| rest.iter().any(|o| o.place.same(&h.place) && o.physics.family == h.physics.family))
}

/// The experiment that determines what the recordings leave open, by the intervals that the verdict reports.
fn determine<'a>(problem: &'a Problem, search: &Search, decision: &Decision, budget: &Budget<'a>) -> Result<Experiment, Reason> {
    let best = decision.best;
    let all: Vec<usize> = (0..best.structure.free.len()).collect();
    let deviations: Vec<f64> = all.iter().map(|number| decision.spread.half(*number) / NORMAL_975).collect();
    excite(problem, &best.structure, &best.fit.values, &all, &deviations, &search.noise_sd, budget)
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
        sensor: plan.sensor.clone().map(|NewSensor { kind, of, element, noise_sd }| Box::new(Sensor { kind, of, element, noise_sd })),
        payload: None,
    }
}
