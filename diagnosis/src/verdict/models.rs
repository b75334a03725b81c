//! Models as they are after the diagnosis.

use crate::belief::intervals::Uncertainty;
use crate::belief::parameters::stated_edits;
use crate::hypothesis::apply_edits;
use crate::output_error::candidate::Candidate;
use crate::recordings::problem::Problem;
use crate::search::Search;
use crate::tuning::tuning;
use backdrive_plant::write::{patch, round_significant};

/// Why a verdict cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum VerdictError {
    /// The model's text cannot be edited.
    #[error(transparent)]
    Patch(#[from] backdrive_plant::write::PatchError),
    /// Refitted parameters cannot be put into the model.
    #[error("the refitted parameters cannot be written into the model: {0}")]
    Refitted(String),
    /// An effect that was found cannot be put into the model.
    #[error(transparent)]
    Hypothesis(#[from] crate::hypothesis::HypothesisError),
}

/// The nominal model's text with the fitted parameters and what was found.
pub(super) fn model_text(problem: &Problem, best: &Candidate, spread: &Uncertainty, use_best: bool) -> Result<String, VerdictError> {
    if !use_best {
        return Ok(problem.text.clone());
    }
    let mut edits = stated_edits(problem, best, spread);
    let mut model = problem.model.clone();
    apply_edits(&mut model, &edits).map_err(VerdictError::Refitted)?;
    for (hypothesis, values) in best.structure.added.iter().zip(best.structure.added_of(&best.fit.values)) {
        let rounded: Vec<f64> = values.iter().map(|v| round_significant(*v, 7)).collect();
        edits.extend(hypothesis.edits(&model, &rounded)?);
        model = hypothesis.apply(&model, &rounded)?;
    }
    let edits = match &problem.inverse {
        Some(inverse) => inverse.in_file(edits),
        None => edits,
    };
    Ok(patch(&problem.text, &edits)?)
}

/// Models of other structures that explain nearly as much of what was fitted and of the held-out recordings.
pub(super) fn rival_models(problem: &Problem, search: &Search, best: &Candidate) -> Vec<String> {
    let names = |c: &Candidate| c.structure.added.iter().map(|h| h.id.clone()).collect::<Vec<_>>();
    let near = |c: &&Candidate| {
        let unseen = match (&best.unseen, &c.unseen) {
            (Some(a), Some(b)) => b.mean_square <= tuning().claim.rival_cost * a.mean_square,
            _ => true,
        };
        unseen && c.fit.cost <= tuning().claim.rival_cost * best.fit.cost && names(c) != names(best)
    };
    let mut rivals: Vec<&Candidate> = search.found.iter().chain([&search.nominal]).filter(near).collect();
    rivals.sort_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
    let text = |c: &Candidate| match problem.inverse {
        Some(_) => model_text(problem, c, &Uncertainty::of(c), true).ok(),
        None => Some(c.structure.model(problem, &c.fit.values)?.to_toml()),
    };
    rivals.into_iter().filter_map(text).take(tuning().claim.rivals).collect()
}
