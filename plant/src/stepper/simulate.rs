//! A model driven by whole recordings.

use super::ahead::ahead;
use super::error::CompileError;
use super::options::Options;
use super::segment::Segment;
use super::spline::segments;
use super::state::Plant;
use crate::model::Model;

/// Outputs of a model, one column of N samples each, driven by `inputs`. There is one column of samples for each input of the model, `period_s`
/// seconds apart, interpolated by the input's `hold`. The model starts at rest, prescribed bodies at their first position. N is the length of the
/// shortest column.
///
/// # Errors
/// When the model cannot be stepped or a column is missing.
pub fn simulate(model: &Model, inputs: &[impl AsRef<[f64]>], period_s: f64, options: &Options) -> Result<Vec<Vec<f64>>, CompileError> {
    if let Some((model, columns)) = ahead(model, inputs, period_s) {
        return simulate(&model, &columns, period_s, options);
    }
    let mut plant = Plant::new(model, period_s, options)?;
    if let Some(missing) = model.inputs.get(inputs.len()) {
        return Err(CompileError::MissingInput(missing.name.clone()));
    }
    let count = inputs.iter().map(|column| column.as_ref().len()).min().unwrap_or(0);
    let columns: Vec<Vec<Segment>> =
        model.inputs.iter().zip(inputs).map(|(input, column)| segments(input.hold, &column.as_ref()[..count], period_s)).collect();
    let first: Vec<f64> = inputs.iter().map(|column| column.as_ref().first().copied().unwrap_or(0.0)).collect();
    plant.start_at(&first);
    let mut outputs = vec![Vec::with_capacity(count); model.outputs.len()];
    let mut values = vec![0.0; model.outputs.len()];
    let mut now = vec![Segment::default(); columns.len()];
    for sample in 0..count {
        plant.outputs(&mut values);
        for (column, value) in outputs.iter_mut().zip(&values) {
            column.push(*value);
        }
        if sample + 1 < count {
            for (segment, column) in now.iter_mut().zip(&columns) {
                *segment = column[sample];
            }
            plant.step(&now);
        }
    }
    Ok(outputs)
}
