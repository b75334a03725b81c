//! Residuals: what a structure predicts held against recordings, divided by the noise standard deviation of each output.

use crate::output_error::coupling::Coupling;
use crate::output_error::structure::{Along, Role, Structure};
use crate::output_error::work::Budget;
use crate::recordings::problem::{Problem, Record};
use crate::tuning::tuning;
use backdrive_plant::model::Model;
use rayon::prelude::*;
use std::ops::Range;

/// What a fit is held against: recordings, the noise standard deviation of each output, and how large errors count.
#[derive(Clone)]
pub struct Evaluator<'a> {
    /// The problem they belong to.
    pub problem: &'a Problem,
    /// The recordings.
    pub records: &'a [Record],
    /// Noise standard deviation of each output, in its unit.
    pub noise_sd: Vec<f64>,
    /// Normalised residuals beyond this count linearly, not by their square (Huber's loss); infinite for none.
    pub robust: f64,
    /// Counts what is computed; every fit ends after its present step once it is used up.
    pub budget: Budget<'a>,
    /// Substeps per sample, at most: fewer are faster, and err more where the model is very stiff.
    pub substeps: usize,
    /// What couples the simulations to the measured motion; `None` for free simulations.
    pub coupling: Option<Coupling>,
    /// Factor on the difference by which derivatives are taken, at first.
    pub stretch: f64,
    /// Largest such factor, where derivatives over narrow differences mislead.
    pub widest: f64,
    /// Whether only parameters of single records move, such as the curve of an unmeasured hand force.
    pub own_only: bool,
    /// The parameters of the model that alone move, beside those of single records; `None` where all do.
    pub only: Option<Vec<Role>>,
}

impl<'a> Evaluator<'a> {
    /// Holds fits against a problem's recordings for fitting.
    pub fn new(problem: &'a Problem) -> Evaluator<'a> {
        Evaluator::on(problem, &problem.fit)
    }

    /// Holds fits against other recordings of the same problem.
    pub fn on(problem: &'a Problem, records: &'a [Record]) -> Evaluator<'a> {
        Evaluator {
            problem,
            records,
            noise_sd: problem.noise_sd.clone(),
            robust: f64::INFINITY,
            budget: Budget::default(),
            substeps: tuning().fit.fine_substeps,
            coupling: None,
            stretch: 1.0,
            own_only: false,
            only: None,
            widest: tuning().fit.widest,
        }
    }

    /// The same, counted by another budget.
    pub fn within(&self, budget: Budget<'a>) -> Evaluator<'a> {
        Evaluator { budget, ..self.clone() }
    }

    /// Number of residuals.
    pub fn len(&self) -> usize {
        self.records.iter().map(residuals_in).sum()
    }

    /// Whether nothing was measured.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where the residuals of a record stand: per measured output, the output's index and its range.
    pub fn layout(&self) -> Vec<(usize, usize, Range<usize>)> {
        let mut all = Vec::new();
        let mut at = 0;
        for (r, record) in self.records.iter().enumerate() {
            for output in measured(record) {
                all.push((r, output, at..at + record.len));
                at += record.len;
            }
        }
        all
    }

    /// Residuals of a structure, `None` where it cannot be simulated.
    pub fn residuals(&self, structure: &Structure, values: &[f64]) -> Option<Vec<f64>> {
        let model = structure.model(self.problem, values)?;
        // All of them even where one fails, so that what is counted does not depend on which thread is first.
        let parts: Vec<Option<Vec<f64>>> =
            (0..self.records.len()).into_par_iter().map(|r| self.record_residuals(structure, &model, values, r)).collect();
        Some(parts.into_iter().collect::<Option<Vec<Vec<f64>>>>()?.concat())
    }

    /// Residuals of one record.
    pub fn record_residuals(&self, structure: &Structure, model: &Model, values: &[f64], r: usize) -> Option<Vec<f64>> {
        let record = self.records.get(r)?;
        let along = Along { substeps: self.substeps, coupling: self.coupling.as_ref(), budget: &self.budget };
        let mut columns = structure.predict(self.problem, model, values, (record, r), along)?;
        for (column, output) in columns.chunks_exact_mut(record.len).zip(measured(record)) {
            let samples = if self.coupling.is_some() { record.outputs.get(output)?.as_deref()? } else { record.compared(output)? };
            column.iter_mut().zip(samples).for_each(|(prediction, sample)| *prediction = sample - *prediction);
        }
        self.normalise(record, &mut columns)?;
        Some(columns)
    }

    /// Derivatives of the residuals of one record by parameters that are given by models, each of which differs in one of them alone, and by how much; see
    /// [`Structure::derivatives`].
    pub(crate) fn record_derivatives(
        &self,
        structure: &Structure,
        models: (&Model, &[(Model, f64)]),
        values: &[f64],
        r: usize,
    ) -> Option<Vec<Vec<f64>>> {
        let record = self.records.get(r)?;
        let along = Along { substeps: self.substeps, coupling: self.coupling.as_ref(), budget: &self.budget };
        let mut derivatives = structure.derivatives(self.problem, models, values, (record, r), along)?;
        for columns in &mut derivatives {
            columns.iter_mut().for_each(|d| *d = -*d);
            self.normalise(record, columns)?;
        }
        Some(derivatives)
    }

    /// Differences between what was measured and what is predicted of a record, over the noise.
    fn normalise(&self, record: &Record, columns: &mut [f64]) -> Option<()> {
        for (column, output) in columns.chunks_exact_mut(record.len).zip(measured(record)) {
            let noise_sd = self.noise_sd.get(output).copied()?;
            let lag = if self.coupling.is_some() { 0 } else { self.problem.lag.get(output).copied().unwrap_or(0) };
            column.iter_mut().for_each(|difference| *difference /= noise_sd);
            if lag > 0 {
                // From the end, so that what is taken off is still the position's.
                for i in (lag..column.len()).rev() {
                    column[i] = (column[i] - column[i - lag]) * std::f64::consts::FRAC_1_SQRT_2;
                }
            }
            column.iter_mut().take(record.skip).for_each(|r| *r = 0.0);
        }
        Some(())
    }

    /// What residuals cost, priors apart.
    pub fn cost(&self, residuals: &[f64]) -> f64 {
        if self.robust.is_infinite() {
            return residuals.iter().map(|r| r * r).sum();
        }
        let k = self.robust;
        residuals.iter().map(|r| if r.abs() <= k { r * r } else { k * (2.0 * r.abs() - k) }).sum()
    }

    /// Weights of the residuals where large ones count linearly.
    pub fn weights(&self, residuals: &[f64]) -> Option<Vec<f64>> {
        self.robust.is_finite().then(|| residuals.iter().map(|r| (self.robust / r.abs().max(1e-300)).min(1.0)).collect())
    }
}

/// Outputs that a record has.
pub fn measured(record: &Record) -> impl Iterator<Item = usize> + '_ {
    record.outputs.iter().enumerate().filter(|(_, samples)| samples.is_some()).map(|(output, _)| output)
}

/// Number of residuals of a record.
pub(crate) fn residuals_in(record: &Record) -> usize {
    measured(record).count() * record.len
}
