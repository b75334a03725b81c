//! The parameters of an arm's or a servo's model refitted to one recording, its structure unchanged.

use crate::answered::{Answered, Row};
use crate::error::FleetError;
use backdrive_diagnosis::arms::fit::Weights;
use backdrive_diagnosis::arms::physics::At;
use backdrive_diagnosis::arms::problem::Problem as ArmProblem;
use backdrive_diagnosis::arms::regression::Data;
use backdrive_servo::problem::Problem as ServoProblem;
use backdrive_servo::refit::refit;
use serde_json::json;

/// Fits with weights by the residuals of the one before: the second one hardly changes them.
const ROUNDS: usize = 3;
/// Ends of a 95 % interval are this many standard errors apart.
const OF_INTERVAL: f64 = 2.0 * 1.959_963_985;

/// Refits the laws that the model states of each joint of an arm, by the regression of joint torques. The links stay within what somebody careful draws.
pub(super) fn arm(problem: &ArmProblem) -> Result<Answered, FleetError> {
    let none = |why: &str| FleetError::input(why.to_string());
    let data = Data::new(problem, None, false).map_err(FleetError::input)?;
    let structure = data.nominal_structure();
    if structure.terms.is_empty() {
        return Err(none("the model states no friction, damping or rotor of its joints, so there is nothing to fit; use --what triage"));
    }
    let joints = problem.joints.len();
    let mut weights = Weights { sd: (0..joints).map(|j| data.scale(j, false).max(1e-9)).collect(), time: vec![1.0; joints] };
    let mut found = None;
    for _ in 0..ROUNDS {
        let fit = data.fit(&structure, &weights).ok_or_else(|| none("the regression has no solution; are all joints logged in motion?"))?;
        weights = data.weights(&fit.residual);
        found = Some(fit);
    }
    let Some(fit) = found else { return Err(none("the regression has no solution")) };
    let mut rows: Vec<Row> = problem.joints.iter().map(|name| Row::of(name)).collect();
    for (term, place) in fit.structure.terms.iter().zip(&fit.places) {
        let At::Joint(joint) = term.at else { continue };
        for (index, at) in place.clone().enumerate() {
            let name = term.physics.facts().name;
            let name = if index == 0 { name.to_string() } else { format!("{name}_{}", index + 1) };
            // Not determined is what could as well have the other sign and twice the size.
            let (value, sd) = (fit.values[at], fit.errors[at]);
            if sd.is_finite() && sd < value.abs().max(f64::MIN_POSITIVE) {
                rows[joint].number(&name, value);
                rows[joint].number(&format!("{name}_sd"), sd);
            }
        }
    }
    for (joint, row) in rows.iter_mut().enumerate() {
        let scale = data.scale(joint, false);
        row.number("nrmse", data.mean_square(&fit.residual, joint, false).sqrt() / scale.max(f64::MIN_POSITIVE));
    }
    Ok(answered(rows))
}

/// Refits the parameters that the model states of each servo.
pub(super) fn servo(problem: &ServoProblem) -> Result<Answered, FleetError> {
    let found = refit(problem).map_err(FleetError::input)?;
    let row = |joint: &backdrive_servo::refit::Refitted| {
        let mut row = Row::of(&joint.joint);
        for (name, estimate) in &joint.numbers {
            row.number(name, estimate.value);
            if let [Some(low), Some(high)] = estimate.ci95 {
                row.number(&format!("{name}_sd"), (high - low) / OF_INTERVAL);
            }
        }
        row.number("nrmse", joint.fitted.unwrap_or(f64::NAN));
        row
    };
    Ok(answered(found.joints.iter().map(row).collect()))
}

fn answered(rows: Vec<Row>) -> Answered {
    let fitted: usize =
        rows.iter().map(|row| row.numbers.keys().filter(|name| row.numbers.contains_key(&format!("{name}_sd"))).count()).sum();
    let sentence = format!("{fitted} parameters of {} joints refitted", rows.len());
    let verdict = json!({ "what": "fit", "sentence": sentence, "joints": rows });
    Answered { sentence, error: None, rows, verdict }
}
