//! What leaving something out costs: the error on recordings with it and without.

use crate::error::PredictError;
use backdrive_diagnosis::belief::compare::{predictions, qualities};
use backdrive_diagnosis::output_error::structure::Structure;
use backdrive_diagnosis::recordings::problem::{Problem, Record};
use backdrive_export::{Change, LeftOut, change_all};
use backdrive_plant::model::Model;
use backdrive_servo::problem::Problem as Servos;
use backdrive_servo::run::free_runs;
use backdrive_servo::search::scored;
use backdrive_sets::{Recordings, open};
use backdrive_signal::statistics::deviation;
use std::path::Path;

/// A joint that hardly moves in a recording, rad or m: its nrmse there is not used.
const MOVES: f64 = 1e-3;

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
    if let Ok(loaded) = Model::load(model)
        && !loaded.servos.is_empty()
    {
        return of_servos(on, model, left_out);
    }
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

/// The same of joints that position servos drive: free runs from the commands, mean over recordings and moving joints.
fn of_servos(on: &Recordings, model: &Path, left_out: &[LeftOut]) -> Result<Errors, PredictError> {
    let (set, _) = open::set_of(on)?;
    let problem = Servos::open(&set, Some(model))?;
    let held_out = problem.joints.iter().any(|j| !j.held_out.is_empty());
    let count = problem.joints.iter().map(|j| if held_out { j.held_out.len() } else { j.fit.len() }).min().unwrap_or(0);
    let error = |changes: &[&Change]| -> Option<f64> {
        let mut changed = problem.model.clone();
        changes.iter().for_each(|change| change.apply(&mut changed));
        let numbers = |name: &str| changed.servos.iter().find(|s| s.joint == name).map(|s| s.numbers);
        let all: Vec<_> = problem.joints.iter().map(|j| numbers(&j.name)).collect();
        let mut shares = Vec::new();
        for index in 0..count {
            let positions = free_runs(&problem, &all, held_out, index).ok()?;
            for (joint, simulated) in problem.joints.iter().zip(&positions).filter(|(j, _)| numbers(&j.name).is_some()) {
                let recorded = if held_out { &joint.held_out[index].position } else { &joint.fit[index].position };
                if deviation(recorded) > MOVES {
                    shares.push(scored(simulated, recorded).0);
                }
            }
        }
        Some(shares.iter().sum::<f64>() / shares.len() as f64).filter(|error| error.is_finite())
    };
    let with_all =
        error(&[]).ok_or_else(|| PredictError::input(format!("{}: no joint with a [servo] moves in the recordings", model.display())))?;
    let without = |left: &LeftOut| if left.changes.is_empty() { None } else { error(&left.changes.iter().collect::<Vec<_>>()) };
    Ok(Errors {
        of: if held_out { "the held-out recordings" } else { "the recordings, none of which is held out" },
        with_all,
        without: left_out.iter().map(without).collect(),
        as_exported: error(&left_out.iter().flat_map(|left| &left.changes).collect::<Vec<_>>()),
        notes: Vec::new(),
    })
}
