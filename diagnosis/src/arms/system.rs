//! Weighted rows, normal equations with the prior of the inertial parameters, and their solution with and without a fold.

use crate::arms::fit::{Structure, TOLERANCES, Weights};
use crate::arms::layout::{Block, Layout};
use crate::arms::physics::{Physics, Term};
use nalgebra::{DMatrix, DVector};
use std::rc::Rc;

/// A column over all rows.
pub type Column = Rc<Vec<f64>>;

/// Solves a positive definite system whose unknowns have very different sizes.
pub(crate) fn scaled_solve(matrix: &DMatrix<f64>, right: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    let scale = DVector::from_fn(n, |i, _| 1.0 / matrix[(i, i)].max(1e-300).sqrt());
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let right = DMatrix::from_fn(n, right.ncols(), |i, j| right[(i, j)] * scale[i]);
    let solved = scaled.cholesky()?.solve(&right);
    Some(DMatrix::from_fn(n, solved.ncols(), |i, j| solved[(i, j)] * scale[i]))
}

/// Weighted rows for fitting, and normal equations with the prior of the inertial parameters.
pub struct System {
    pub(crate) matrix: DMatrix<f64>,
    pub(crate) right: DVector<f64>,
    pub(crate) rows: Vec<(usize, f64)>,
    pub(crate) prior: DVector<f64>,
    pub(crate) scale: DVector<f64>,
    pub(crate) total: DMatrix<f64>,
    pub(crate) total_right: DVector<f64>,
    pub(crate) folds: Vec<(DMatrix<f64>, DVector<f64>)>,
    pub(crate) factor: Factor,
}

/// A factored matrix in scaled unknowns.
pub(crate) struct Factor {
    cholesky: Option<nalgebra::Cholesky<f64, nalgebra::Dyn>>,
    scale: DVector<f64>,
}

impl Factor {
    fn new(matrix: &DMatrix<f64>, scale: &DVector<f64>) -> Factor {
        let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
        Factor { cholesky: scaled.cholesky(), scale: scale.clone() }
    }

    pub(crate) fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let scaled = right.component_mul(&self.scale);
        match &self.cholesky {
            Some(c) => c.solve(&scaled).component_mul(&self.scale),
            None => DVector::zeros(right.len()),
        }
    }
}

impl System {
    /// Of columns over all rows, the first `inertial` of which have a prior; `left` is what they have to explain.
    pub fn new(
        layout: &Layout,
        blocks: &[Block],
        left: &[f64],
        columns: &[Column],
        tolerance: usize,
        weights: &Weights,
        inertial: usize,
    ) -> System {
        let joints = layout.joints;
        let weight: Vec<f64> = (0..joints).map(|j| 1.0 / (weights.sd[j] * weights.time[j].sqrt())).collect();
        let mut rows = Vec::new();
        let mut of_fold: Vec<Vec<usize>> = Vec::new();
        for block in blocks {
            let Some(fold) = block.fold else { continue };
            of_fold.resize(of_fold.len().max(fold + 1), Vec::new());
            for (joint, w) in weight.iter().enumerate() {
                let first = layout.of(block.motion, joint).start;
                for row in first + block.rows.start..first + block.rows.end {
                    of_fold[fold].push(rows.len());
                    rows.push((row, *w));
                }
            }
        }
        let matrix = DMatrix::from_fn(rows.len(), columns.len(), |i, j| columns[j][rows[i].0] * rows[i].1);
        let right = DVector::from_fn(rows.len(), |i, _| left[rows[i].0] * rows[i].1);
        let mut first = 0;
        let mut folds = Vec::new();
        for fold in &of_fold {
            // Rows of a fold are neighbours.
            let part = matrix.rows(first, fold.len());
            folds.push((part.tr_mul(&part), part.tr_mul(&right.rows(first, fold.len()))));
            first += fold.len();
        }
        let n = columns.len();
        let mut total = DMatrix::zeros(n, n);
        let mut total_right = DVector::zeros(n);
        for (m, r) in &folds {
            total += m;
            total_right += r;
        }
        let tolerance = TOLERANCES.get(tolerance).copied().unwrap_or(1.0);
        let prior = DVector::from_fn(n, |i, _| if i < inertial { 1.0 / (tolerance * tolerance) } else { 1e-9 * total[(i, i)] + 1e-300 });
        let scale = DVector::from_fn(n, |i, _| 1.0 / (total[(i, i)] + prior[i]).max(1e-300).sqrt());
        let factor = Factor::new(&(&total + DMatrix::from_diagonal(&prior)), &scale);
        System { matrix, right, rows, prior, scale, total, total_right, folds, factor }
    }

    pub(crate) fn solve(&self, without: Option<usize>) -> Option<DVector<f64>> {
        let Some((matrix, right)) = without.and_then(|f| self.folds.get(f)) else {
            self.factor.cholesky.as_ref()?;
            return Some(self.factor.solve(&self.total_right));
        };
        let factor = Factor::new(&(&self.total - matrix + DMatrix::from_diagonal(&self.prior)), &self.scale);
        factor.cholesky.as_ref()?;
        Some(factor.solve(&(&self.total_right - right)))
    }

    pub(crate) fn weighted(&self, column: &Column) -> DVector<f64> {
        DVector::from_fn(self.rows.len(), |i, _| column[self.rows[i].0] * self.rows[i].1)
    }

    pub(crate) fn residual(&self, values: &DVector<f64>) -> DVector<f64> {
        &self.right - &self.matrix * values
    }

    /// `δᵀ P δ + ln det(H) - ln det(P)` of the inertial parameters, the first `n`, with H their own curvature where all else follows.
    pub(crate) fn occam(&self, values: &DVector<f64>, n: usize) -> Option<f64> {
        let log_det = |from: usize| -> Option<f64> {
            let count = values.len() - from;
            let whole = &self.total + DMatrix::from_diagonal(&self.prior);
            let part = DMatrix::from_fn(count, count, |i, j| whole[(from + i, from + j)] * self.scale[from + i] * self.scale[from + j]);
            let scales: f64 = (from..values.len()).map(|i| self.scale[i].ln()).sum();
            if count == 0 {
                return Some(0.0);
            }
            Some(2.0 * part.cholesky()?.l().diagonal().iter().map(|d| d.ln()).sum::<f64>() - 2.0 * scales)
        };
        let prior: f64 = (0..n).map(|i| values[i] * values[i] * self.prior[i] - self.prior[i].ln()).sum();
        Some(prior + log_det(0)? - log_det(n)?)
    }

    /// Standard errors, and how many numbers the data determine.
    pub(crate) fn errors(
        &self,
        values: &DVector<f64>,
        of_folds: &[Option<DVector<f64>>],
        structure: &Structure,
    ) -> Option<(Vec<f64>, f64, DMatrix<f64>)> {
        let n = values.len();
        let mut covariance = DMatrix::zeros(n, n);
        self.factor.cholesky.as_ref()?;
        let mut errors = Vec::with_capacity(n);
        let mut numbers = 0.0;
        let folds: Vec<&DVector<f64>> = of_folds.iter().flatten().collect();
        for i in 0..n {
            let mut unit = DVector::zeros(n);
            unit[i] = 1.0;
            let variance = self.factor.solve(&unit);
            covariance.set_column(i, &variance);
            // Of the trace of (G + P)⁻¹ G: what the data say beside what was known before.
            numbers += 1.0 - variance[i] * self.prior[i];
            let mean = folds.iter().map(|f| f[i]).sum::<f64>() / folds.len().max(1) as f64;
            let k = folds.len() as f64;
            let jackknife = folds.iter().map(|f| (f[i] - mean).powi(2)).sum::<f64>() * (k - 1.0).max(0.0) / k.max(1.0);
            errors.push(variance[i].max(jackknife).max(0.0).sqrt());
        }
        // Parameters of a shape were searched, and are no columns.
        let searched: usize = structure.terms.iter().filter(|t| t.given.is_none()).map(shape_numbers).sum();
        Some((errors, numbers + searched as f64, covariance))
    }
}

/// Parameters of a term in which the torque is not linear, where they are searched.
fn shape_numbers(term: &Term) -> usize {
    match term.physics {
        Physics::Stribeck | Physics::Presliding | Physics::Cogging | Physics::Compliance | Physics::Backlash => 1,
        _ => 0,
    }
}
