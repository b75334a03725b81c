//! The force error as the field computes it: position through a fourth-order zero-phase Butterworth at 100 Hz, central differences, a
//! fourth-order zero-phase 40 Hz filter on every column, one sample in ten.

use super::prepare::{RATE, Record};
use crate::StudyError;
use backdrive_plant::model::Model;
use backdrive_plant::stepper::{Options, simulate};
use backdrive_signal::derivative;
use backdrive_signal::low_pass::LowPass;
use nalgebra::{DMatrix, DVector};

/// Filter on every column: order, Hz.
const PARALLEL: (usize, f64) = (4, 40.0);
/// One in this number of samples is kept.
const DECIMATE: usize = 10;
/// Decimated samples at both ends that the filters spoil.
const ENDS: usize = 5;

/// A published structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// Mass, viscous and Coulomb friction, offset.
    Symmetric,
    /// Mass, viscous and Coulomb friction in either direction.
    Asymmetric,
}

/// Relative errors, %: on the record that was fitted and on the other one.
pub(super) struct Error {
    /// Training.
    pub here: f64,
    /// Pulses.
    pub there: f64,
}

/// Filters and decimates a column.
fn reduced(column: &[f64]) -> Vec<f64> {
    let all: Vec<f64> = LowPass::butterworth(PARALLEL.0, PARALLEL.1, RATE).both_ways(column).into_iter().step_by(DECIMATE).collect();
    all.get(ENDS..all.len().saturating_sub(ENDS)).unwrap_or(&[]).to_vec()
}

/// The columns that a form's numbers multiply.
fn columns(record: &Record, form: Form) -> Vec<Vec<f64>> {
    let v = derivative(&record.position, 1.0 / RATE);
    let a = derivative(&v, 1.0 / RATE);
    let of = |f: fn(f64) -> f64| v.iter().map(|v| f(*v)).collect::<Vec<f64>>();
    let sign = |v: f64| {
        if v > 0.0 {
            1.0
        } else if v < 0.0 {
            -1.0
        } else {
            0.0
        }
    };
    let rest: Vec<Vec<f64>> = match form {
        Form::Symmetric => vec![v.clone(), of(sign), vec![1.0; v.len()]],
        Form::Asymmetric => {
            vec![of(|v| v.max(0.0)), of(|v| v.min(0.0)), of(|v| if v > 0.0 { 1.0 } else { 0.0 }), of(|v| if v < 0.0 { -1.0 } else { 0.0 })]
        }
    };
    std::iter::once(a).chain(rest).map(|c| reduced(&c)).collect()
}

/// A form's numbers by least squares on a record, and its error there.
pub(super) fn regressed(record: &Record, form: Form) -> Result<(Vec<f64>, f64), StudyError> {
    let (columns, force) = (columns(record, form), reduced(&record.force));
    let matrix = DMatrix::from_fn(force.len(), columns.len(), |i, j| columns[j][i]);
    let right = DVector::from_column_slice(&force);
    let solved = matrix.svd(true, true).solve(&right, 1e-12).map_err(|e| StudyError::Diagnosis(e.to_string()))?;
    let numbers: Vec<f64> = solved.iter().copied().collect();
    let error = error_of(record, form, &numbers);
    Ok((numbers, error))
}

/// Error of a form with these numbers on a record, %.
pub(super) fn error_of(record: &Record, form: Form, numbers: &[f64]) -> f64 {
    let columns = columns(record, form);
    let force = reduced(&record.force);
    let predicted: Vec<f64> = (0..force.len()).map(|i| columns.iter().zip(numbers).map(|(c, n)| n * c[i]).sum()).collect();
    relative(&force, &predicted)
}

/// Error of a model that is moved along the record and asked for the reaction, %.
pub(super) fn error_of_model(record: &Record, model: &Model) -> Result<f64, StudyError> {
    let failed = |e: &dyn std::fmt::Display| StudyError::Diagnosis(format!("{}: {e}", model.name));
    let predicted = simulate(model, &[&record.position], 1.0 / RATE, &Options::default()).map_err(|e| failed(&e))?;
    let predicted = predicted.first().ok_or_else(|| failed(&"has no output"))?;
    Ok(relative(&reduced(&record.force), &reduced(predicted)))
}

/// Steps in a ripple's period in which a record's zero is looked for.
const STEPS: usize = 50;

/// Least error over where the record's encoder counts from, within a ripple's period, and that place, m: a number of the record, not of the
/// axis. `None` where the model has no ripple.
pub(super) fn error_from_its_zero(record: &Record, model: &Model) -> Result<Option<(f64, f64)>, StudyError> {
    let ripple = model.elements.iter().find(|e| e.law.kind().name == "cogging");
    let Some(period) = ripple.and_then(|e| model.values_at(&format!("elements.{}.period", e.name)).ok()?.first().copied()) else {
        return Ok(None);
    };
    let mut best: Option<(f64, f64)> = None;
    for step in 0..STEPS {
        let zero = period * (step as f64 / STEPS as f64 - 0.5);
        let mut from_there = model.clone();
        from_there.inputs.iter_mut().for_each(|input| input.offset = zero);
        let error = error_of_model(record, &from_there)?;
        if best.is_none_or(|(least, _)| error < least) {
            best = Some((error, zero));
        }
    }
    Ok(best)
}

/// 100 times the size of the difference over that of the first.
fn relative(measured: &[f64], predicted: &[f64]) -> f64 {
    let size = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>().sqrt();
    100.0 * size(&mut measured.iter().zip(predicted).map(|(m, p)| m - p)) / size(&mut measured.iter().copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_made_by_a_form_gives_its_numbers_back() {
        let n = 8000;
        let q: Vec<f64> = (0..n).map(|i| 0.05 * (i as f64 * 0.004).sin() + 0.02 * (i as f64 * 0.0093).sin()).collect();
        let record = Record::new(vec![0.0; n], &q, vec![0.0; n], vec![0.0; n]);
        let numbers = [90.0, 150.0, 230.0, 20.0, 21.0];
        let v = derivative(&record.position, 1.0 / RATE);
        let a = derivative(&v, 1.0 / RATE);
        let friction = |v: f64| if v > 0.0 { 150.0 * v + 20.0 } else { 230.0 * v - 21.0 };
        let force: Vec<f64> = a.iter().zip(&v).map(|(a, v)| numbers[0] * a + friction(*v)).collect();
        let record = Record { force, ..record };
        let (found, error) = regressed(&record, Form::Asymmetric).unwrap();
        assert!(found.iter().zip(numbers).all(|(f, n)| (f / n - 1.0).abs() < 1e-9), "{found:?}");
        assert!(error < 1e-9);
        assert!(regressed(&record, Form::Symmetric).unwrap().1 > 1.0);
    }
}
