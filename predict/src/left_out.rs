//! What leaving something out costs: the error on recordings with it and without.

use crate::error::PredictError;
use backdrive_diagnosis::belief::compare::{predictions, qualities};
use backdrive_diagnosis::output_error::structure::Structure;
use backdrive_diagnosis::recordings::problem::{Problem, Record};
use backdrive_export::{Change, LeftOut, change_all};
use backdrive_plant::model::Model;
use backdrive_sets::{Recordings, open};
use std::path::Path;

/// Errors of a model on recordings, as nrmse: over the standard deviation of what was measured, mean of all outputs and records.
pub struct Errors {
    /// On which recordings.
    pub of: &'static str,
    /// Of the model.
    pub with_all: f64,
    /// Of the model without each thing that is left out; `None` where it cannot be simulated, or moves as with it.
    pub without: Vec<Option<f64>>,
    /// Of the model without all of them.
    pub as_exported: Option<f64>,
    /// What a reader should know of the recordings.
    pub notes: Vec<String>,
}

/// The errors of the model in a file on recordings.
///
/// # Errors
/// When a recording is wrong, or the model itself cannot be simulated.
pub fn errors(on: &Recordings, model: &Path, ignored: &[String], left_out: &[LeftOut]) -> Result<Errors, PredictError> {
    let opened = open::open(on, Some(model), None, ignored)?;
    let problem = opened.problem;
    let (records, of) = match problem.held_out.is_empty() {
        true => (problem.fit.clone(), "the recordings, none of which is held out"),
        false => (problem.held_out.clone(), "the held-out recordings"),
    };
    let changed = |changes: &[&Change]| {
        let mut model = problem.model.clone();
        changes.iter().for_each(|change| change.apply(&mut model));
        error_of(&problem, model, &records)
    };
    let with_all =
        changed(&[]).ok_or_else(|| PredictError::input(format!("{}: cannot be simulated on the recordings", model.display())))?;
    let without = |left: &LeftOut| if left.changes.is_empty() { None } else { changed(&left.changes.iter().collect::<Vec<_>>()) };
    Ok(Errors {
        of,
        with_all,
        without: left_out.iter().map(without).collect(),
        as_exported: error_of(&problem, change_all(&problem.model, left_out), &records),
        notes: opened.notes,
    })
}

/// nrmse of a model that nothing is fitted of, but where the recordings begin.
fn error_of(problem: &Problem, model: Model, records: &[Record]) -> Option<f64> {
    let problem = Problem { model, stated: Vec::new(), ..problem.clone() };
    let structure = Structure::new(&problem, records, Vec::new());
    let values = structure.values(&problem, &[], &[], &[]);
    let predicted = predictions(&problem, records, &structure, &values)?;
    let all = qualities(&problem, records, &predicted, &problem.noise_sd, false);
    let sum: f64 = all.iter().map(|q| q.nrmse).sum();
    Some(sum / all.len() as f64).filter(|error| error.is_finite())
}
