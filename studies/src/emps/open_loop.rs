//! The position error of open-loop simulation, as leaderboards of this benchmark show it: the model, driven by the recorded force from the first sample
//! of a record, against the recorded position. The axis is a pure integrator there, so that whatever is off by a constant force runs away.

use super::prepare::{RATE, Record};
use crate::run::write;
use crate::table::Report;
use crate::{Context, StudyError};
use backdrive_plant::model::{Hold, InputKind, Model, OutputKind};
use backdrive_plant::stepper::{Options, simulate};
use backdrive_signal::statistics::rms;
use nalgebra::{DMatrix, DVector};

/// Bar on the error in the record with the pulses, mm.
const BAR: f64 = 3.5;
/// Parameters that the refit may move, where a model has them.
const NUMBERS: [&str; 11] = [
    "bodies.carriage",
    "elements.viscous.damping",
    "elements.viscous.positive",
    "elements.viscous.negative",
    "elements.friction.force",
    "elements.friction.positive",
    "elements.friction.negative",
    "elements.friction.coulomb",
    "elements.friction.rest",
    "elements.friction.velocity",
    "elements.offset.force",
];
/// Rounds of the refit, and the share of a number by which it is moved to see what it does.
const ROUNDS: usize = 30;
/// See [`ROUNDS`].
const DIFFERENCE: f64 = 1e-4;

/// The published models unchanged, and a found one both unchanged and with its parameters refitted to the training record's position.
pub(super) fn run(report: &mut Report, context: &Context, found: &Model, train: &Record, pulses: &Record) -> Result<(), StudyError> {
    let error = |model: &Model| -> Result<[f64; 2], StudyError> { Ok([rmse(model, train)?, rmse(model, pulses)?]) };
    for (what, file) in [("symmetric form", "symmetric.toml"), ("asymmetric form", "asymmetric.toml")] {
        let model = driven(&Model::load(&context.folder.join(file))?);
        line(report, &format!("published {what}"), error(&model)?, None);
    }
    let model = driven(found);
    let frozen = error(&model)?;
    line(report, "found model, frozen", frozen, Some(frozen[1] <= BAR));
    let refitted = refitted(model, train)?;
    write(&context.out.join("open-loop.toml"), &refitted.to_toml())?;
    let after = error(&refitted)?;
    line(report, "found model, refitted to the training record's position", after, Some(after[1] <= BAR));
    Ok(())
}

fn line(report: &mut Report, what: &str, [here, there]: [f64; 2], within: Option<bool>) {
    report.figure(&format!("open loop {what}"), there);
    report.line(
        &format!("open-loop position error, {what}, training / pulses"),
        format!("{here:.2} / {there:.2} mm"),
        "5.17 mm polynomial NARX, 3.84 to 4.3 mm refitted physics",
        "leaderboards of the benchmark",
        within,
    );
}

/// A model that was moved, driven by the force instead.
fn driven(model: &Model) -> Model {
    let mut model = model.clone();
    let period = 1.0 / RATE;
    let mut offset = 0.0;
    for input in &mut model.inputs {
        // What was found is a motion that is late behind samples of the force; held for a sample, the force is late by half of one by itself.
        let late = -input.delay - 0.5 * period;
        offset += input.offset;
        (input.name, input.kind, input.hold, input.delay, input.offset) =
            ("force".to_string(), InputKind::Force, Hold::Zero, late.max(0.0), 0.0);
    }
    for output in &mut model.outputs {
        output.name = "position".to_string();
        output.kind = OutputKind::Position(model.inputs.first().map_or(0, |i| i.on));
        (output.offset, output.delay, output.noise) = (output.offset - offset, 0.0, 0.0);
    }
    model
}

/// A model with its parameters fitted to a record's position by Levenberg-Marquardt steps.
fn refitted(mut model: Model, record: &Record) -> Result<Model, StudyError> {
    let paths: Vec<&str> = NUMBERS.iter().copied().filter(|path| model.values_at(path).is_ok()).collect();
    let moved = |model: &Model, steps: &[f64]| -> Result<Model, StudyError> {
        let mut other = model.clone();
        for (path, step) in paths.iter().zip(steps) {
            let now = other.values_at(path).map_err(StudyError::Diagnosis)?;
            // In shares of the number; one that is near 0 moves by some thousandths of the force.
            let next: Vec<f64> = now.iter().map(|x| x + step * x.abs().max(0.05)).collect();
            other.set_values_at(path, &next).map_err(StudyError::Diagnosis)?;
        }
        Ok(other)
    };
    let mut damping = 1e-3;
    let mut residual = DVector::from_vec(residuals(&model, record)?);
    for _ in 0..ROUNDS {
        let mut columns = Vec::new();
        for i in 0..paths.len() {
            let steps: Vec<f64> = (0..paths.len()).map(|j| if i == j { DIFFERENCE } else { 0.0 }).collect();
            columns.push((DVector::from_vec(residuals(&moved(&model, &steps)?, record)?) - &residual) / DIFFERENCE);
        }
        let jacobian = DMatrix::from_columns(&columns);
        let (normal, gradient) = (jacobian.transpose() * &jacobian, jacobian.transpose() * &residual);
        let mut better = false;
        while !better && damping < 1e6 {
            let damped = &normal + DMatrix::from_diagonal(&normal.diagonal().map(|d| damping * d));
            let step = damped.lu().solve(&(-&gradient)).unwrap_or_else(|| DVector::zeros(paths.len()));
            // What no model can have (a negative mass) is no better.
            let tried = moved(&model, step.as_slice()).and_then(|m| Ok((residuals(&m, record)?, m)));
            if let Ok((next, other)) = tried {
                let next = DVector::from_vec(next);
                if next.norm() < residual.norm() {
                    (better, model, residual) = (true, other, next);
                }
            }
            damping *= if better { 0.2 } else { 5.0 };
        }
        if !better {
            break;
        }
    }
    Ok(model)
}

/// Recorded position less that of a model driven by the recorded force, both from the first sample, m.
fn residuals(model: &Model, record: &Record) -> Result<Vec<f64>, StudyError> {
    let failed = |e: &dyn std::fmt::Display| StudyError::Diagnosis(format!("{}: {e}", model.name));
    let predicted = simulate(model, &[&record.force], 1.0 / RATE, &Options::default()).map_err(|e| failed(&e))?;
    let predicted = predicted.first().ok_or_else(|| failed(&"has no output"))?;
    let (begin, own) = (record.position.first().copied().unwrap_or(0.0), predicted.first().copied().unwrap_or(0.0));
    Ok(record.position.iter().zip(predicted).map(|(m, p)| m - begin - p + own).collect())
}

/// Root mean square of the position error from the first sample to the last, mm.
fn rmse(model: &Model, record: &Record) -> Result<f64, StudyError> {
    let all = residuals(model, record)?;
    Ok(1e3 * rms(&all))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_that_moved_a_record_are_found_again() {
        let text = |mass: f64, damping: f64, force: f64| {
            format!(
                "name = \"axis\"\nmotion = \"translation\"\n[bodies]\ncarriage = {mass}\n\
                 [[elements]]\nname = \"viscous\"\nkind = \"damper\"\nbetween = [\"carriage\", \"ground\"]\ndamping = {damping}\n\
                 [[elements]]\nname = \"offset\"\nkind = \"bias\"\nbetween = [\"carriage\", \"ground\"]\nforce = {force}\n\
                 [[inputs]]\nname = \"force\"\nkind = \"force\"\non = \"carriage\"\n\
                 [[outputs]]\nname = \"position\"\nkind = \"position\"\nof = \"carriage\"\n"
            )
        };
        let (own, off) =
            (Model::from_toml(&text(95.0, 200.0, -1.0), "axis").unwrap(), Model::from_toml(&text(80.0, 260.0, 0.5), "axis").unwrap());
        let force: Vec<f64> = (0..3000).map(|i| 60.0 * (f64::from(i) * 0.01).sin() + 20.0 * (f64::from(i) * 0.037).cos()).collect();
        let position = simulate(&own, &[&force], 1.0 / RATE, &Options::default()).unwrap().remove(0);
        let record = Record { force, position, asked: Vec::new(), pulses: Vec::new() };
        assert!(rmse(&off, &record).unwrap() > 1.0);
        let found = refitted(off, &record).unwrap();
        assert!(rmse(&found, &record).unwrap() < 1e-3, "{}", found.to_toml());
        assert!((found.values_at("bodies.carriage").unwrap()[0] - 95.0).abs() < 0.1);
    }
}
