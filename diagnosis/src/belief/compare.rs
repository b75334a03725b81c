//! Predictions of a fitted structure for recordings that were not fitted, and their residuals.

use crate::belief::predictive::{Gain, gain};
use crate::belief::statistics::correlation_time;
use crate::output_error::effort::Effort;
use crate::output_error::evaluator::{Evaluator, measured};
use crate::output_error::structure::{Along, Structure};
use crate::output_error::work::Budget;
use crate::recordings::problem::{Problem, Record};
pub use crate::recordings::signal::density;
use crate::tuning::tuning;
use backdrive_signal::statistics::rms;
use serde::Serialize;

/// Predictions of each output of the model in one record, in the output's unit, before rounding; `None` where it was not recorded.
pub type Predicted = Vec<Option<Vec<f64>>>;

/// A structure with these values, ready for held-out recordings: where a record starts freely, or a parameter is free in it, that is fitted to the record,
/// and nothing else.
struct Ready {
    fixed: Problem,
    own: Structure,
    values: Vec<f64>,
}

impl Ready {
    fn of(problem: &Problem, records: &[Record], structure: &Structure, values: &[f64]) -> Option<Ready> {
        let fixed = Problem { model: structure.model(problem, values)?, stated: Vec::new(), ..problem.clone() };
        let mut own = Structure::new(&fixed, records, Vec::new());
        own.free.retain(|n| n.records.is_some());
        let mut values = own.values(&fixed, &[], &[], &[]);
        if !own.free.is_empty()
            && let Some(fit) = Evaluator::on(&fixed, records).fit(&own, &values, Effort { steps: 15, tolerance: 1.0 })
        {
            values = fit.values;
        }
        Some(Ready { fixed, own, values })
    }
}

/// Predictions of a structure with these values for each of `records`. Where a record starts freely, or a parameter is free in it, that is fitted first,
/// and nothing else. `None` where the structure cannot be simulated.
pub fn predictions(problem: &Problem, records: &[Record], structure: &Structure, values: &[f64]) -> Option<Vec<Predicted>> {
    let Ready { fixed, own, values } = Ready::of(problem, records, structure, values)?;
    let budget = Budget::default();
    let along = Along { substeps: tuning().fit.fine_substeps, coupling: None, budget: &budget };
    let one = |(r, record): (usize, &Record)| {
        let columns = own.predict(&fixed, &fixed.model, &values, (record, r), along)?;
        let mut of_outputs: Predicted = vec![None; record.outputs.len()];
        for (column, output) in columns.chunks_exact(record.len.max(1)).zip(measured(record)) {
            *of_outputs.get_mut(output)? = Some(column.to_vec());
        }
        Some(of_outputs)
    };
    records.iter().enumerate().map(one).collect()
}

/// Residuals of a structure in recordings that were not fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOut {
    /// Mean square of the normalised residuals, noise variances.
    pub mean_square: f64,
    /// Their correlation time, samples: an error of amplitude or a drift correlates thousands of samples, which then count as one.
    pub correlation_time: f64,
    /// The same mean square, block by block: of each record and output a list, in the order of their samples.
    pub blocks: Vec<Vec<f64>>,
}

impl HeldOut {
    /// How much better another explanation predicts these recordings; `None` where there are too few blocks to say.
    pub fn gain_over(&self, better: &HeldOut) -> Option<Gain> {
        gain(&self.blocks, &better.blocks)
    }
}

/// Residuals of a structure with these values in `records`, normalised by the noise standard deviations `noise_sd`.
pub fn unseen(problem: &Problem, records: &[Record], structure: &Structure, values: &[f64], noise_sd: &[f64]) -> Option<HeldOut> {
    let ready = Ready::of(problem, records, structure, values)?;
    let evaluator = Evaluator { noise_sd: noise_sd.to_vec(), ..Evaluator::on(&ready.fixed, records) };
    let residuals = evaluator.residuals(&ready.own, &ready.values).filter(|r| !r.is_empty())?;
    let mean_square = residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64;
    Some(HeldOut { mean_square, correlation_time: correlation_time(&evaluator, &residuals), blocks: blocks(&evaluator, &residuals) })
}

/// Mean squares of residuals over blocks: for each record and output a list, with a block for every [`crate::tuning::Claim::blocks`]th part of the record.
pub fn blocks(evaluator: &Evaluator, residuals: &[f64]) -> Vec<Vec<f64>> {
    let mean_square = |block: &[f64]| block.iter().map(|r| r * r).sum::<f64>() / block.len().max(1) as f64;
    let of = |part: &[f64]| {
        let length = (part.len() / tuning().claim.blocks).max(tuning().claim.block_samples);
        part.chunks(length).filter(|block| 2 * block.len() > length).map(mean_square).collect()
    };
    evaluator.layout().into_iter().filter_map(|(_, _, range)| residuals.get(range)).map(of).collect()
}

/// Mean squared error of a structure with these values at every output measured in every record, in the unit squared: record by record, outputs in the
/// order of [`measured`]. Where records start freely, or a parameter is free in a file, that is fitted first, and nothing else. `None` where the structure
/// cannot be simulated.
pub fn mean_squares(problem: &Problem, records: &[Record], structure: &Structure, values: &[f64]) -> Option<Vec<f64>> {
    let predicted = predictions(problem, records, structure, values)?;
    let mut all = Vec::new();
    for (record, predicted) in records.iter().zip(&predicted) {
        for output in measured(record) {
            let (samples, column) = (record.compared(output)?, predicted.get(output)?.as_deref()?);
            let squares = column.iter().zip(samples).skip(record.skip).map(|(a, b)| (a - b) * (a - b));
            all.push(squares.sum::<f64>() / record.len.saturating_sub(record.skip).max(1) as f64);
        }
    }
    Some(all)
}

/// How well an output of a record is predicted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quality {
    /// The record.
    pub record: String,
    /// The output.
    pub output: String,
    /// Root of the mean squared error over the standard deviation of what was measured.
    pub nrmse: f64,
    /// Root of the mean squared error over the noise standard deviation; of a position that no spring holds, that of its displacement over a lag, as fits
    /// compare it.
    pub floors: f64,
    /// Whether fits saw this record.
    pub fitted: bool,
}

/// Quality of predictions of `records`. `noise_sd` is the noise standard deviation of each output, in its unit.
pub fn qualities(problem: &Problem, records: &[Record], predicted: &[Predicted], noise_sd: &[f64], fitted: bool) -> Vec<Quality> {
    let mut all = Vec::new();
    for (record, predicted) in records.iter().zip(predicted) {
        for (index, output) in problem.model.outputs.iter().enumerate() {
            let (Some(samples), Some(Some(column))) = (record.compared(index), predicted.get(index)) else { continue };
            let error: Vec<f64> = samples.iter().zip(column).skip(record.skip).map(|(y, p)| y - p).collect();
            let lag = problem.lag.get(index).copied().unwrap_or(0);
            let lagged: Vec<f64> = match lag {
                0 => error.clone(),
                _ => error.iter().skip(lag).zip(&error).map(|(a, b)| (a - b) * std::f64::consts::FRAC_1_SQRT_2).collect(),
            };
            all.push(Quality {
                record: record.name.clone(),
                output: output.name.clone(),
                nrmse: rms(&error) / record.spread.get(index).copied().unwrap_or(1.0),
                floors: rms(&lagged) / noise_sd.get(index).copied().unwrap_or(1.0).max(f64::MIN_POSITIVE),
                fitted,
            });
        }
    }
    all
}
