//! Errors in a prediction although no effect is missing: the integration, when samples were taken, steps of encoders.

use crate::belief::statistics::levels;
use crate::output_error::candidate::Candidate;
use crate::output_error::evaluator::{Evaluator, measured};
use crate::output_error::hold::HoldEvidence;
use crate::output_error::simulate::{TWICE, predict};
use crate::recordings::noise::{step_of, white};
use crate::recordings::problem::{Problem, Record};
use crate::tuning::tuning;
use backdrive_plant::model::{InputKind, Model, OutputKind};
use backdrive_plant::stepper::segments;
use backdrive_signal::statistics::rms;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where an error of a prediction comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The integration: what half the step changes.
    Integration,
    /// The clock: how far samples are from their grid, times how fast the output changes.
    Clock,
    /// Rounding of the output to its step.
    Rounding,
    /// How an input that is taken as held runs between its samples, as far as neither the model file nor the recordings tell.
    Hold,
    /// Noise and rounding of a motion that drives the model: what another noise of the same size changes.
    DrivingMotion,
    /// A velocity computed from encoder counts: the mean over a sample period instead of the velocity at its middle.
    Differencing,
}

/// An error at one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BudgetedError {
    /// Where it comes from.
    pub source: Source,
    /// The output.
    pub output: String,
    /// Its root mean square, in standard deviations of the sensor noise.
    pub noise_sd: f64,
}

/// Every error of the predictions of a fitted structure; `holds` is its evidence on inputs between their samples.
pub fn error_budget(evaluator: &Evaluator, fitted: &Candidate, holds: &[HoldEvidence]) -> Vec<BudgetedError> {
    let (structure, values) = (&fitted.structure, &fitted.fit.values);
    let (problem, noise_sd) = (evaluator.problem, &evaluator.noise_sd);
    let mut all = Vec::new();
    let mut add = |source: Source, errors: Vec<f64>| {
        for (output, error) in problem.model.outputs.iter().zip(errors).filter(|(_, error)| *error > 0.0) {
            all.push(BudgetedError { source, output: output.name.clone(), noise_sd: error });
        }
    };
    let fine = Evaluator { substeps: TWICE, ..evaluator.clone() };
    let there = evaluator.residuals(structure, values);
    if let (Some(a), Some(b)) = (&there, fine.residuals(structure, values)) {
        let apart: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
        add(Source::Integration, levels(evaluator, &apart));
    }
    for evidence in holds {
        add(Source::Hold, evidence.unknown());
    }
    let relative = |errors: Vec<f64>| errors.iter().zip(noise_sd).map(|(error, sd)| error / sd).collect();
    add(Source::Clock, relative(clock(problem)));
    let steps = |output: usize| {
        let signals: Vec<&[f64]> = problem.fit.iter().filter_map(|r| r.compared(output)).collect();
        let stated = problem.model.outputs[output].resolution;
        let step = if stated > 0.0 { stated } else { signals.iter().find_map(|s| step_of(s)).unwrap_or(0.0) };
        step / 12.0f64.sqrt()
    };
    add(Source::Rounding, relative((0..problem.model.outputs.len()).map(steps).collect()));
    if let Some(residuals) = &there {
        let steps = |output: usize| steps(output) > 0.0;
        add(Source::Differencing, levels(evaluator, &differencing(evaluator, residuals, &steps)));
    }
    // What it does is in the residual, and what of that is white is in the noise: it is no larger than all of it.
    let driven = structure.model(problem, values).map_or_else(Vec::new, |model| of_driving_motion(&model, &problem.fit));
    add(Source::DrivingMotion, relative(driven).into_iter().map(|error: f64| error.min(1.0)).collect());
    all
}

/// What of it is no white noise of the sensor, so that an effect may imitate it: the largest of the outputs, noise variances. An input that runs on is early, which no effect is.
pub fn beside_noise(all: &[BudgetedError]) -> f64 {
    largest(all, |source| !matches!(source, Source::Rounding | Source::Hold))
}

/// The same for errors of the recordings as they were taken. Two structures whose parameters have adapted to such an error cannot be separated by less than
/// its size. Finer steps of the integration change both alike.
pub fn of_sensors(all: &[BudgetedError]) -> f64 {
    largest(all, |source| matches!(source, Source::Clock | Source::Differencing))
}

fn largest(all: &[BudgetedError], counts: impl Fn(Source) -> bool) -> f64 {
    let of = |output: &str| all.iter().filter(|e| counts(e.source) && e.output == output).map(|e| e.noise_sd * e.noise_sd).sum::<f64>();
    all.iter().map(|e| of(&e.output)).fold(0.0, f64::max)
}

/// Difference between a mean over a sample and the value at its middle, for each residual, normalised. It is a twenty-fourth of the second difference of
/// the predicted velocity, the first term of its series. 0 for outputs that are not velocities in steps.
fn differencing(evaluator: &Evaluator, residuals: &[f64], is_in_steps: &dyn Fn(usize) -> bool) -> Vec<f64> {
    let outputs = &evaluator.problem.model.outputs;
    let mut all = vec![0.0; residuals.len()];
    for (r, output, range) in evaluator.layout() {
        let is_velocity = outputs.get(output).is_some_and(|o| matches!(o.kind, OutputKind::Velocity(_)));
        let samples = evaluator.records.get(r).and_then(|record| record.compared(output));
        let (Some(samples), Some(left), Some(own)) = (samples, residuals.get(range.clone()), all.get_mut(range)) else { continue };
        if !is_velocity || !is_in_steps(output) {
            continue;
        }
        let noise_sd = evaluator.noise_sd.get(output).copied().unwrap_or(1.0);
        let predicted: Vec<f64> = samples.iter().zip(left).map(|(y, r)| y / noise_sd - r).collect();
        for (slot, three) in own.iter_mut().skip(1).zip(predicted.windows(3)) {
            *slot = (three[0] - 2.0 * three[1] + three[2]) / 24.0;
        }
    }
    all
}

/// What the irregularity of the clocks may put each output off by, in its unit.
fn clock(problem: &Problem) -> Vec<f64> {
    let mut squares = vec![(0.0, 0usize); problem.model.outputs.len()];
    // Times that are even but for the digits they were written with are not irregular.
    for record in problem.fit.iter().filter(|r| r.logged.is_none() && r.jitter.rms > tuning().recordings.rounded_times * r.period) {
        for output in measured(record) {
            let Some(samples) = record.outputs[output].as_deref() else { continue };
            // Over two samples, so that noise does not look like speed; what noise adds is taken off.
            let change: f64 = samples.windows(3).map(|w| (w[2] - w[0]).powi(2)).sum::<f64>() / samples.len() as f64;
            let rate = (change - 2.0 * problem.noise_sd[output].powi(2)).max(0.0) / (2.0 * record.period).powi(2);
            squares[output].0 += rate * record.jitter.rms.powi(2) * samples.len() as f64;
            squares[output].1 += samples.len();
        }
    }
    squares.iter().map(|(sum, count)| if *count > 0 { (sum / *count as f64).sqrt() } else { 0.0 }).collect()
}

/// What noise and rounding of the motions that drive the model put each output off by, in its unit: the difference that another noise of the same size
/// makes. Such a motion goes through springs, and is differentiated twice on its way to a force, so that a small error of it may be a large force.
pub fn of_driving_motion(model: &Model, fit: &[Record]) -> Vec<f64> {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut squares = vec![(0.0, 0usize); model.outputs.len()];
    for record in fit.iter().take(tuning().recordings.driving_records) {
        let even = Record { logged: None, ..record.clone() };
        let mut other = even.clone();
        let mut is_moved = false;
        for (index, input) in model.inputs.iter().enumerate().filter(|(_, i)| i.kind == InputKind::Motion) {
            let Some(samples) = record.inputs.get(index) else { continue };
            let step = step_of(samples).unwrap_or(0.0);
            let error = white(samples).unwrap_or(0.0).max(step / 12.0f64.sqrt());
            // What is smaller than the digits of a file is none.
            if error <= tuning().recordings.least_noise * rms(samples) {
                continue;
            }
            let moved: Vec<f64> =
                samples.iter().map(|x| x + error * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut random)).collect();
            other.segments[index] = segments(input.hold, &moved, record.period);
            other.inputs[index] = moved;
            is_moved = true;
        }
        if !is_moved {
            continue;
        }
        let substeps = tuning().fit.coarse_substeps;
        let (Some(a), Some(b)) = (predict(model, &even, substeps), predict(model, &other, substeps)) else { continue };
        for ((a, b), output) in a.chunks_exact(record.len).zip(b.chunks_exact(record.len)).zip(measured(record)) {
            squares[output].0 += a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            squares[output].1 += record.len;
        }
    }
    squares.iter().map(|(sum, count)| if *count > 0 { (sum / *count as f64).sqrt() } else { 0.0 }).collect()
}
