//! Recordings of a band: motion and force through the same low-pass, and as many samples as the band needs.

use crate::recordings::problem::{Problem, Record};
use crate::tuning::tuning;
use backdrive_plant::model::{InputKind, Model, OutputKind};
use backdrive_plant::stepper::segments;
use backdrive_signal::derivative;
use backdrive_signal::low_pass::LowPass;
use std::sync::Arc;

/// From this share of the sample rate on a motion is taken for noise of its sensor.
const HIGHEST: f64 = 0.35;

/// Whether force and motion of a problem are both known: one body, moved along the recorded motion, and the force that this took.
pub(crate) fn is_known(problem: &Problem) -> bool {
    let model = &problem.model;
    let is_moved = matches!(model.inputs.as_slice(), [input] if input.kind == InputKind::Motion);
    let is_force = |output: usize| matches!(model.outputs.get(output).map(|o| &o.kind), Some(OutputKind::Reaction(_)));
    let measures_force =
        |record: &Record| crate::output_error::evaluator::measured(record).eq((0..model.outputs.len()).filter(|o| is_force(*o)).take(1));
    model.bodies.len() == 1
        && !model.elements.iter().any(|e| has_memory(e.law.kind().name))
        && is_moved
        && problem.unknown.is_empty()
        && problem.fit.iter().chain(&problem.held_out).all(|record| measures_force(record) && record.conditions.is_empty())
}

/// Whether the force of an element of this kind depends on the path. Its parameters are then not factors of columns, not even approximately.
pub(super) fn has_memory(kind: &str) -> bool {
    crate::physics::physics_named(kind).is_some_and(|physics| physics.facts.memory)
}

/// Corners of the bands in which the motion is resolved, Hz, the lowest first.
pub(crate) fn corners(problem: &Problem) -> Vec<f64> {
    let motions: Vec<(&[f64], f64)> = problem.fit.iter().filter_map(|r| Some((r.inputs.first()?.as_slice(), r.period))).collect();
    corners_of(&motions, tuning().equation_error.highest_corner)
}

/// The same of recordings of a position, each with its sample period, s. `highest`: the highest corner, in the sample rate.
pub(crate) fn corners_of(motions: &[(&[f64], f64)], highest: f64) -> Vec<f64> {
    let tuning = &tuning().equation_error;
    let rate = motions.iter().map(|(_, period)| 1.0 / period).fold(f64::INFINITY, f64::min);
    let longest = motions.iter().map(|(q, period)| q.len() as f64 * period).fold(0.0f64, f64::max);
    let all = tuning.corners.iter().copied();
    let mut held: Vec<f64> = all.filter(|corner| *corner < highest * rate && corner * longest > tuning.least_periods).collect();
    while held.len() > 1 && held.last().is_some_and(|corner| noise_of_acceleration(motions, *corner) > tuning.most_noise) {
        held.pop();
    }
    // The lowest say least, and what they say is in the others too.
    held.drain(..held.len().saturating_sub(tuning.bands));
    held
}

/// Share of the acceleration's power in a band that is sensor noise of the motion. The noise is taken for white, with the density found near half the sample rate.
fn noise_of_acceleration(motions: &[(&[f64], f64)], corner: f64) -> f64 {
    let (mut noise, mut power) = (0.0, 0.0);
    for (motion, period) in motions {
        let rate = 1.0 / period;
        let order = tuning().equation_error.order;
        let low = LowPass::butterworth(order, HIGHEST * rate, rate).both_ways(motion);
        let density = motion.iter().zip(&low).map(|(x, l)| (x - l) * (x - l)).sum::<f64>() / ((0.5 - HIGHEST) * rate);
        noise += density * std::f64::consts::TAU.powi(4) * corner.powi(5) / 5.0;
        let motion = LowPass::butterworth(order, corner, rate).both_ways(motion);
        let acceleration = derivative(&derivative(&motion, *period), *period);
        power += acceleration.iter().map(|a| a * a).sum::<f64>();
    }
    noise / power.max(f64::MIN_POSITIVE)
}

/// The problem in a band below a corner, Hz.
pub(crate) fn in_band(problem: &Problem, corner: f64) -> Problem {
    let of = |records: &[Record]| records.iter().map(|record| filtered(&problem.model, record, corner)).collect();
    Problem { fit: of(&problem.fit), held_out: of(&problem.held_out), lag: vec![0; problem.lag.len()], ..problem.clone() }
}

/// The low-pass of a band at a record's rate.
pub(crate) fn low_pass(record: &Record, corner: f64) -> LowPass {
    LowPass::butterworth(tuning().equation_error.order, corner, 1.0 / record.period)
}

fn filtered(model: &Model, record: &Record, corner: f64) -> Record {
    let (order, rate) = (tuning().equation_error.order, 1.0 / record.period);
    let low_pass = low_pass(record, corner);
    let every = ((rate / (tuning().equation_error.samples * corner)) as usize).max(1);
    let of = |samples: &Vec<f64>| low_pass.both_ways(samples).into_iter().step_by(every).collect::<Vec<f64>>();
    let period = record.period * every as f64;
    let inputs: Vec<Vec<f64>> = record.inputs.iter().map(of).collect();
    let outputs: Vec<Option<Vec<f64>>> = record.outputs.iter().map(|o| o.as_ref().map(of)).collect();
    let segments = model.inputs.iter().zip(&inputs).map(|(input, samples)| segments(input.hold, samples, period)).collect();
    Record {
        period,
        len: record.len.div_ceil(every),
        segments,
        inputs,
        outputs,
        logged: None,
        low_pass: Some(Arc::new(LowPass::butterworth(order, corner, 1.0 / period))),
        skip: 0,
        ..record.clone()
    }
}
