//! The parameters of a model's servo joints refitted, their effects unchanged.

use crate::diagnose::{floor, numbers_of};
use crate::error::ServoError;
use crate::fit::{Problem as Fits, substeps};
use crate::inputs::{Use, looked_at};
use crate::problem::Problem;
use crate::record::Record;
use crate::search::{candidate_of, scored, sizes};
use crate::simulate::simulate;
use backdrive_diagnosis::verdict::Estimate;
use backdrive_plant::model::Model;
use backdrive_plant::servo::{FACTS, Number, Numbers};
use backdrive_signal::statistics::{deviation, median};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Steps of the fit that shows how large the errors of each recording are.
const FIRST: usize = 6;

/// A joint that was fitted again.
#[derive(Debug, Clone)]
pub struct Refitted {
    /// Its name.
    pub joint: String,
    /// Its parameters by key, with their intervals.
    pub numbers: BTreeMap<String, Estimate>,
    /// Median nrmse of free runs of the given numbers on held-out recordings, else on those that were fitted; `None` where the joint rests in all.
    pub given: Option<f64>,
    /// The same of the fitted numbers.
    pub fitted: Option<f64>,
    values: Numbers,
}

/// What a fit gives.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Each joint that the model has a servo of and that moves.
    pub joints: Vec<Refitted>,
    /// The model with their parameters.
    pub model: Model,
}

/// Fits the parameters that a model states, all but those at values without effect.
///
/// # Errors
/// Where a command is none, or no joint of the model was recorded.
pub fn refit(problem: &Problem) -> Result<Fitted, ServoError> {
    let mut used = Vec::new();
    for joint in problem.joints.iter().filter(|j| j.given.is_some()) {
        if looked_at(joint)? == Use::Good {
            used.push(joint);
        }
    }
    if used.is_empty() {
        return Err(ServoError::wrong(
            "set.toml: joints",
            "no joint of the model's [servo] moves in these recordings; use the joint names of the model",
        ));
    }
    let joints: Vec<Refitted> = used
        .par_iter()
        .map(|joint| {
            let given = joint.given.unwrap_or_default();
            let records: Vec<&Record> = joint.fit.iter().collect();
            let free: BTreeSet<Number> =
                FACTS.iter().filter(|f| given[f.number] != f.nothing).map(|f| f.number).chain([Number::Inertia, Number::Damping]).collect();
            let free: Vec<Number> = free.into_iter().collect();
            let resolution = floor(&records);
            let mut fits = Fits::new(records.clone(), sizes(&records).lag.max(resolution));
            let first = fits.fit(&free, &given, FIRST, None);
            fits.rescale(&first.numbers, resolution.max(1e-9));
            let candidate = candidate_of(&fits, Vec::new(), &free, &first.numbers);
            let judged = if joint.held_out.is_empty() { &joint.fit } else { &joint.held_out };
            let errors = |n: &Numbers| {
                let moving = judged.iter().filter(|r| deviation(&r.position) > 1e-3);
                median(moving.map(|r| scored(&simulate(n, r, substeps(r)), &r.position).0).collect())
            };
            Refitted {
                joint: joint.name.clone(),
                numbers: numbers_of(&candidate),
                given: errors(&given),
                fitted: errors(&candidate.fit.numbers),
                values: candidate.fit.numbers,
            }
        })
        .collect();
    let mut model = problem.model.clone();
    for servo in &mut model.servos {
        if let Some(joint) = joints.iter().find(|j| j.joint == servo.joint) {
            servo.numbers = joint.values;
        }
    }
    Ok(Fitted { joints, model })
}
