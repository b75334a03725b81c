//! A model run on a recording: what its sensors would have said before rounding.

use crate::problem::Record;
use backdrive_plant::model::Model;
use backdrive_plant::set::Condition;
use backdrive_plant::stepper::{Options, Plant, Segment};

/// A motion that a record starts with: body, position in m, velocity in m/s.
pub type Start = (usize, f64, f64);

/// Predictions of a record's measured outputs, one column after the other in the order of the model, `record.len` samples each.
/// At most `substeps` per sample. `None` where the model cannot be simulated or its motion leaves all bounds.
pub fn predict(model: &Model, record: &Record, starts: &[Start], substeps: usize) -> Option<Vec<f64>> {
    let conditioned;
    let model = if record.conditions.iter().any(|(_, c)| matches!(c, Condition::Value(_))) {
        let mut changed = model.clone();
        for (path, condition) in &record.conditions {
            if let Condition::Value(value) = condition {
                changed.set_values_at(path, &[*value]).ok()?;
            }
        }
        conditioned = changed;
        &conditioned
    } else {
        model
    };
    let mut plant = Plant::new(model, record.period, &Options::default()).ok()?;
    if plant.substeps() > substeps {
        plant = Plant::new(model, record.period, &Options { substeps: Some(substeps), ..Options::default() }).ok()?;
    }
    let first: Vec<f64> = record.inputs.iter().map(|samples| samples.first().copied().unwrap_or(0.0)).collect();
    plant.start_at(&first);
    for (body, position, velocity) in starts {
        plant.set_motion(*body, *position, *velocity);
    }
    let measured: Vec<usize> = (0..model.outputs.len()).filter(|o| record.outputs.get(*o).is_some_and(Option::is_some)).collect();
    let mut columns = vec![0.0; measured.len() * record.len];
    let mut values = vec![0.0; model.outputs.len()];
    let mut now = vec![Segment::default(); record.segments.len()];
    for sample in 0..record.len {
        plant.outputs(&mut values);
        for (column, output) in measured.iter().enumerate() {
            columns[column * record.len + sample] = values[*output];
        }
        if sample % 256 == 0 && !plant.is_finite() {
            return None;
        }
        if sample + 1 < record.len {
            for (segment, column) in now.iter_mut().zip(&record.segments) {
                *segment = column[sample];
            }
            plant.step(&now);
        }
    }
    columns.iter().all(|y| y.is_finite()).then_some(columns)
}
