//! Rival models: what each predicts for an experiment, and how much of the difference of two predictions a change of parameters cannot explain.

use super::setup::{Setup, Trial};
use crate::belief::statistics::correlation_time;
use crate::output_error::effort::Effort;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::{Fit, dot};
use crate::output_error::normal_equations::normal_equations;
use crate::output_error::structure::{FreeParameter, Structure};
use crate::recordings::problem::Problem;
use crate::tuning::tuning;
use backdrive_plant::model::{Model, OutputKind};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A fitted structure.
pub(super) struct Rival<'a> {
    pub structure: &'a Structure,
    /// Its parameters, in the fit's own unit.
    pub own: Vec<f64>,
    /// Fisher information of the recordings about them: the curvature of half the cost, with residuals in noise standard deviations.
    information: DMatrix<f64>,
    /// Cost that counts as one squared standard deviation, at least 1: the mean square of the residuals times their correlation time.
    pub unit: f64,
}

impl<'a> Rival<'a> {
    /// From where a fit ended.
    pub(super) fn of(problem: &Problem, structure: &'a Structure, fit: &Fit) -> Rival<'a> {
        let count = fit.residuals.len().max(1) as f64;
        let level = fit.residuals.iter().map(|r| r * r).sum::<f64>() / count;
        let unit = level.max(1.0) * correlation_time(&Evaluator::new(problem), &fit.residuals);
        Rival::with(structure, &fit.values, &fit.jacobian, unit)
    }

    /// From values and the derivatives of the recordings' residuals.
    pub(super) fn with(structure: &'a Structure, values: &[f64], jacobian: &[Vec<f64>], unit: f64) -> Rival<'a> {
        let numbers = &structure.free;
        let mut information = match jacobian.len() == numbers.len() && !numbers.is_empty() {
            true => normal_equations(jacobian, &vec![0.0; jacobian[0].len()], None).0,
            false => DMatrix::zeros(numbers.len(), numbers.len()),
        };
        for (j, number) in numbers.iter().enumerate() {
            let (low, high) = number.bounds();
            // A parameter without prior is somewhere in its range.
            let spread = number.prior.map_or(high - low, |(_, spread)| spread.min(high - low));
            information[(j, j)] += 1.0 / (spread * spread).max(f64::MIN_POSITIVE);
        }
        let own = numbers.iter().zip(values).map(|(n, v)| n.to_internal(*v)).collect();
        Rival { structure, own, information, unit: if unit.is_finite() { unit.max(1.0) } else { 1.0 } }
    }

    fn model(&self, problem: &Problem, own: &[f64]) -> Option<Model> {
        let values: Vec<f64> = self.structure.free.iter().zip(own).map(|(n, x)| n.to_external(*x)).collect();
        self.structure.model(problem, &values)
    }

    /// Its model.
    pub(super) fn as_fitted(&self, problem: &Problem) -> Option<Model> {
        self.model(problem, &self.own)
    }

    /// What it predicts, in noise standard deviations.
    pub(super) fn prediction(&self, setup: &Setup, trial: &Trial) -> Option<Vec<f64>> {
        setup.prediction(&self.as_fitted(setup.problem)?, trial)
    }

    /// Derivatives of its prediction, by each parameter in its own unit; all 0 for what belongs to a recording.
    pub(super) fn jacobian(&self, setup: &Setup, trial: &Trial, own: &[f64], at: &[f64]) -> Vec<Vec<f64>> {
        let column = |(j, number): (usize, &FreeParameter)| {
            let none = || vec![0.0; at.len()];
            if number.records.is_some() {
                return none();
            }
            let (low, high) = number.bounds();
            let mut moved = own.to_vec();
            moved[j] = if own[j] + number.step > high { own[j] - number.step } else { own[j] + number.step }.clamp(low, high);
            let step = moved[j] - own[j];
            let there = self.model(setup.problem, &moved).and_then(|model| setup.prediction(&model, trial));
            match there.filter(|_| step != 0.0) {
                Some(mut there) => {
                    there.iter_mut().zip(at).for_each(|(a, b)| *a = (*a - b) / step);
                    there
                }
                None => none(),
            }
        };
        self.structure.free.par_iter().enumerate().map(column).collect()
    }

    /// Predicted cost of a difference d of predictions after a Gauss-Newton step that also keeps to the recordings, in noise variances. With the Jacobian J
    /// of the experiment and the information M of the recordings it is the minimum over s of |d - J s|² + s' M s.
    pub(super) fn unexplained(&self, jacobian: &[Vec<f64>], difference: &[f64]) -> f64 {
        let whole = dot(difference, difference);
        let (mut matrix, right) = normal_equations(jacobian, difference, None);
        matrix += &self.information;
        let scale: Vec<f64> = (0..right.len()).map(|j| matrix[(j, j)].sqrt().max(f64::MIN_POSITIVE)).collect();
        let scaled =
            DMatrix::from_fn(right.len(), right.len(), |a, b| matrix[(a, b)] / (scale[a] * scale[b]) + if a == b { 1e-12 } else { 0.0 });
        let short = DVector::from_fn(right.len(), |j, _| right[j] / scale[j]);
        // Without a Cholesky factor no separation is claimed.
        scaled.cholesky().map_or(0.0, |c| (whole - short.dot(&c.solve(&short))).clamp(0.0, whole))
    }

    /// The same for the difference from another structure's prediction, `target`, after all Gauss-Newton steps that lower the cost. Where a law has a
    /// threshold or an end, the first step alone is not informative. `pick` takes the outputs that count.
    pub(super) fn unexplained_after_steps(
        &self,
        setup: &Setup,
        trial: &Trial,
        target: &[f64],
        pick: &dyn Fn(&[f64]) -> Vec<f64>,
    ) -> Option<f64> {
        let wanted = pick(target);
        let from = DVector::from_column_slice(&self.own);
        let cost = |own: &[f64], prediction: &[f64]| {
            let away = DVector::from_column_slice(own) - &from;
            let left: f64 = pick(prediction).iter().zip(&wanted).map(|(a, b)| (a - b) * (a - b)).sum();
            left + away.dot(&(&self.information * &away))
        };
        let mut own = self.own.clone();
        let mut prediction = setup.prediction(&self.model(setup.problem, &own)?, trial)?;
        let mut least = cost(&own, &prediction);
        for _ in 0..tuning().experiment.imitating_steps {
            let jacobian: Vec<Vec<f64>> = self.jacobian(setup, trial, &own, &prediction).iter().map(|c| pick(c)).collect();
            let difference: Vec<f64> = wanted.iter().zip(pick(&prediction)).map(|(a, b)| a - b).collect();
            let (mut matrix, mut right) = normal_equations(&jacobian, &difference, None);
            matrix += &self.information;
            right -= &self.information * (DVector::from_column_slice(&own) - &from);
            let size = matrix.diagonal().max();
            for j in 0..own.len() {
                matrix[(j, j)] += 1e-12 * size;
            }
            let Some(step) = matrix.cholesky().map(|c| c.solve(&right)) else { break };
            let shorter = (0..4).find_map(|half| {
                let moved = |(j, n): (usize, &FreeParameter)| (own[j] + step[j] * 0.5f64.powi(half)).clamp(n.bounds().0, n.bounds().1);
                let next: Vec<f64> = self.structure.free.iter().enumerate().map(moved).collect();
                let there = setup.prediction(&self.model(setup.problem, &next)?, trial)?;
                let now = cost(&next, &there);
                (now < least).then_some((next, there, now))
            });
            let Some((next, there, now)) = shorter else { break };
            let is_end = now > 0.99 * least;
            (own, prediction, least) = (next, there, now);
            if is_end {
                break;
            }
        }
        Some(least)
    }

    /// The same by a true refit to the recordings and to the prediction of `other` for the experiment. The result is the increase of the cost over that on
    /// the recordings alone, in noise variances.
    pub(super) fn refit(&self, setup: &Setup, trial: &Trial, other: &Rival) -> Option<f64> {
        let columns = setup.outputs_of(&other.as_fitted(setup.problem)?, trial)?;
        let mut record = trial.record.clone();
        for (column, output) in columns.chunks_exact(record.len).zip(setup.outputs(&trial.record)) {
            *record.outputs.get_mut(output)? = Some(column.to_vec());
        }
        let mut wider = setup.problem.clone();
        wider.fit.push(record);
        let mut evaluator = Evaluator::new(&wider);
        (evaluator.noise_sd, evaluator.substeps, evaluator.budget) = (setup.sensors.noise_sd.clone(), setup.substeps, setup.budget.clone());
        let values: Vec<f64> = self.structure.free.iter().zip(&self.own).map(|(n, x)| n.to_external(*x)).collect();
        let fit = evaluator.fit(self.structure, &values, Effort { steps: 20, tolerance: 1.0 })?;
        evaluator.records = &setup.problem.fit;
        let before = evaluator.cost(&evaluator.residuals(self.structure, &values)?);
        let pulled = |(n, x): (&FreeParameter, &f64)| n.prior.map_or(0.0, |(centre, spread)| ((x - centre) / spread).powi(2));
        let priors: f64 = self.structure.free.iter().zip(&self.own).map(pulled).sum();
        Some((fit.cost - before - priors).max(0.0))
    }

    /// Standard deviations of its parameters in their own unit, with the derivatives of an experiment or without.
    pub(super) fn deviations(&self, jacobian: Option<&[Vec<f64>]>) -> Vec<f64> {
        let mut matrix = self.information.clone();
        if let Some(jacobian) = jacobian.filter(|j| j.len() == self.own.len() && !j.is_empty()) {
            matrix += normal_equations(jacobian, &vec![0.0; jacobian[0].len()], None).0;
        }
        let scale: Vec<f64> = (0..self.own.len()).map(|j| matrix[(j, j)].sqrt().max(f64::MIN_POSITIVE)).collect();
        let scaled =
            DMatrix::from_fn(scale.len(), scale.len(), |a, b| matrix[(a, b)] / (scale[a] * scale[b]) + if a == b { 1e-12 } else { 0.0 });
        let inverse = scaled.cholesky().map(|c| c.inverse());
        let one = |j: usize| inverse.as_ref().map_or(f64::INFINITY, |i| (i[(j, j)] * self.unit).sqrt() / scale[j]);
        (0..scale.len()).map(one).collect()
    }

    /// How far its positions and speeds go beyond what was recorded: the largest ratio of peaks, 0 where there is nothing to compare.
    pub(super) fn excursion(&self, setup: &Setup, trial: &Trial) -> Option<f64> {
        let columns = setup.outputs_of(&self.as_fitted(setup.problem)?, trial)?;
        let mut worst = 0.0f64;
        for (column, output) in columns.chunks_exact(trial.record.len).zip(setup.outputs(&trial.record)) {
            let kind = &setup.problem.model.outputs.get(output)?.kind;
            if !matches!(kind, OutputKind::Position(_) | OutputKind::Velocity(_)) {
                continue;
            }
            let recorded = setup.problem.fit.iter().chain(&setup.problem.held_out).filter_map(|r| r.outputs.get(output)?.as_deref());
            let shown = recorded.map(|y| y.iter().fold(0.0f64, |a, x| a.max((x - y.first().unwrap_or(&0.0)).abs()))).fold(0.0, f64::max);
            let reached = column.iter().fold(0.0f64, |a, x| a.max((x - column.first().unwrap_or(&0.0)).abs()));
            if shown > 0.0 {
                worst = worst.max(reached / shown);
            }
        }
        Some(worst)
    }
}
