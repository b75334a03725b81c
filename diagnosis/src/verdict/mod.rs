//! The result of a search: the verdict, the nominal model's file with what was found, and the files beside it.

mod experiments;
pub(crate) mod findings;
mod held_out;
mod models;
mod remaining;
mod rounded;
mod schema;
mod sentence;
mod shows;
pub(crate) mod signals;
mod timing;
pub(crate) mod types;
pub mod words;

pub use experiments::EXPERIMENT_FILE;
pub use findings::figures_of;
pub use models::VerdictError;
pub use schema::schema;
pub use timing::timing;
pub use types::*;

use crate::audit;
use crate::belief::compare::unseen;
use crate::belief::decision::{Decision, Doubt, decide};
use crate::belief::plausible;
use crate::locate::Location;
use crate::output_error::candidate::Candidate;
use crate::output_error::observed::recorded;
use crate::output_error::structure::{Role, Structure};
use crate::output_error::work::{Budget, Limit};
use crate::recordings::problem::Problem;
use crate::search::Search;
use crate::tuning::tuning;
use backdrive_plant::model::Model;
use experiments::next_experiment;
use findings::{detectable, moved};
use held_out::held_out;
use models::{model_text, rival_models};
use remaining::remaining;
use sentence::sentence;
use shows::shows;
use signals::unknown_inputs;
use std::collections::BTreeMap;

/// Name of the verdict file.
pub const VERDICT_FILE: &str = "verdict.json";
/// Name of the diagnosed model's file.
pub const MODEL_FILE: &str = "model.diagnosed.toml";
/// Name of the file of a rival's model, from 1.
pub fn rival_file(number: usize) -> String {
    format!("model.rival-{number}.toml")
}

/// What is written beside a verdict: texts of files.
#[derive(Debug, Clone, PartialEq)]
pub struct Files {
    /// The model file with what was found, [`MODEL_FILE`].
    pub model: String,
    /// Models of other explanations whose residual is little larger, the nearest first, as [`rival_file`]: what is built on the verdict has to stand
    /// with these too.
    pub rivals: Vec<String>,
    /// The excitation file of the next experiment, [`EXPERIMENT_FILE`]; `None` where none is needed or can be had.
    pub experiment: Option<String>,
}

/// The verdict of a search on a problem, and the files beside it. `remarks` are the audit's findings on the recordings. `location` is the latent force that
/// the refitted nominal model needs, where it could be had. `limit` ends the search for the next experiment.
///
/// # Errors
/// When what was found cannot be written into the model's text.
pub fn verdict(
    problem: &Problem,
    search: &Search,
    remarks: &[audit::Remark],
    location: Option<&Location>,
    limit: Limit,
) -> Result<(Verdict, Files), VerdictError> {
    let mut decision = decide(problem, search);
    let best = decision.best;
    let budget = Budget::new(tuning().search.experiment, limit);
    let (next_experiment, experiment) = next_experiment(problem, search, &mut decision, &budget);
    if matches!(decision.word, Word::Ambiguous | Word::CannotTell) {
        findings::share_with_rivals(search, best, &decision.alike, &mut decision.findings);
    }
    let held_out = without_what_predicts_worse(problem, search, &mut decision);
    let changes = decision.changes;
    let model = model_text(problem, best, &decision.spread, changes)?;
    let rivals = rival_models(problem, search, best);
    let verdict = Verdict {
        schema: SCHEMA,
        word: decision.word,
        sentence: sentence(&decision, experiment.is_some()),
        shows: shows(problem, search, &decision, location),
        parameters: if changes { moved(problem, best, &decision.spread) } else { BTreeMap::new() },
        remaining: remaining(problem, search, &decision, &held_out),
        error_budget: search.errors.clone(),
        held_out,
        audit: remarks.iter().map(Remark::from).collect(),
        unknown_inputs: unknown_inputs(problem, best),
        model_after: MODEL_FILE.to_string(),
        rival_models: (1..=rivals.len()).map(rival_file).collect(),
        next_experiment,
        detectable: best.structure.added.is_empty().then(|| detectable(search)),
        searched: Some(Searched { steps: search.work, exhausted: search.exhausted, cut_short: search.cut }),
        findings: decision.findings,
        arm: None,
        servo: None,
    };
    Ok((verdict, Files { model, rivals, experiment }))
}

/// Errors on held-out recordings. Where what was found predicts them worse than the model as given does, the model as given is returned unchanged, and
/// nothing is claimed as likelier than not.
fn without_what_predicts_worse(problem: &Problem, search: &Search, decision: &mut Decision) -> HeldOut {
    // A model is used without an observer, and its errors are those of a free simulation.
    let free = recorded(problem);
    let errors = held_out(free, search, decision.best, decision.changes);
    let is_worse_than = |other: Option<f64>| other.zip(errors.nrmse_after).is_some_and(|(other, after)| after > other);
    let unseen = !problem.held_out.is_empty();
    decision.doubt = match () {
        () if decision.changes && unseen && is_worse_than(errors.nrmse_before) => Some(Doubt::WorseThanGiven),
        () if decision.changes && unseen && is_worse_simulated(problem, decision) => Some(Doubt::WorseSimulated),
        () if decision.findings.is_empty() => None,
        () if unseen && is_worse_than(errors.nrmse_refit) => Some(Doubt::WorseThanRefit),
        () if search.forces.is_some() && is_at_an_end(decision.best) => Some(Doubt::AtAnEnd),
        () => None,
    };
    let Some(doubt) = decision.doubt else { return errors };
    decision.findings.iter_mut().for_each(|finding| {
        finding.confidence = finding.confidence.min(tuning().claim.as_likely);
        finding.family_confidence = finding.family_confidence.min(tuning().claim.as_likely);
    });
    if !matches!(doubt, Doubt::WorseThanGiven | Doubt::WorseSimulated) {
        return errors;
    }
    decision.changes = false;
    held_out(free, search, decision.best, false)
}

/// Whether, of a device that forces drive and whose laws were looked at on forces, the model that would be written simulates the held-out motion worse.
fn is_worse_simulated(problem: &Problem, decision: &Decision) -> bool {
    let Some(recorded) = problem.inverse.as_ref().map(|inverse| inverse.recorded.as_ref()) else { return false };
    let left = |model: Model| {
        let fixed = Problem { model, stated: Vec::new(), ..recorded.clone() };
        let structure = Structure::new(&fixed, &fixed.held_out, Vec::new());
        let values = structure.values(&fixed, &[], &[], &[]);
        Some(unseen(&fixed, &fixed.held_out, &structure, &values, &fixed.noise_sd)?.mean_square)
    };
    let written = model_text(problem, decision.best, &decision.spread, true).ok().and_then(|text| Model::from_toml(&text, MODEL_FILE).ok());
    match (left(recorded.model.clone()), written.and_then(left)) {
        (Some(given), Some(written)) => written > given,
        (_, None) => true,
        (None, Some(_)) => false,
    }
}

/// Whether a parameter of the nominal model, or the size of an effect, is at an end of what the fit may try.
fn is_at_an_end(best: &Candidate) -> bool {
    let stated = best.structure.free.iter().zip(&best.fit.values).filter(|(number, _)| matches!(number.role, Role::Stated(_)));
    stated.into_iter().any(|(number, value)| number.at_bound(*value).is_some()) || !plausible::is_plausible(best)
}
