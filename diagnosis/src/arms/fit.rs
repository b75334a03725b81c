//! A structure, and a structure fitted.

use crate::arms::physics::Term;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Standard deviation that an inertial parameter may have about the file's, in the size of the body: as it stands, as drawn by
/// somebody careful, as guessed, free.
pub const TOLERANCES: [f64; 4] = [0.003, 0.02, 0.15, 1.0];

/// What a fit has free.
#[derive(Debug, Clone, PartialEq)]
pub struct Structure {
    /// Which of [`TOLERANCES`] the inertial parameters have.
    pub tolerance: usize,
    /// Terms of the nominal model, then those that a search has added.
    pub terms: Vec<Term>,
    /// Displacement over which friction turns, by joint, rad or m.
    pub slip: Vec<f64>,
}

/// How much each row counts, and how many rows count as one.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    /// Standard deviation of the residual of each joint, N m or N.
    pub sd: Vec<f64>,
    /// Correlation time of the residual of each joint, rows, at least 1.
    pub time: Vec<f64>,
}

/// A structure fitted to the logs for fitting.
#[derive(Debug, Clone)]
pub struct Fit {
    /// What was free.
    pub structure: Structure,
    /// Changes of the inertial parameters in their sizes, then the parameters of the terms in their order.
    pub values: Vec<f64>,
    /// Standard errors of the same: the larger one of that of the fit and that of the folds (jackknife).
    pub errors: Vec<f64>,
    /// Where each term's parameters are in the values.
    pub places: Vec<Range<usize>>,
    /// Residuals of all rows.
    pub residual: Vec<f64>,
    /// Residuals of the rows for fitting, each by a fit that has not seen it; of held-out rows as `residual`.
    pub unseen: Vec<f64>,
    /// How many numbers the data have determined.
    pub numbers: f64,
    /// Twice the negative logarithm of the evidence, but for a constant; smaller is better.
    pub score: f64,
    /// What of that the inertial parameters cost: how far they are from the file's, and how much the data narrow them down.
    pub occam: f64,
    /// Covariance of the values.
    pub covariance: DMatrix<f64>,
    /// Values of each fold.
    pub of_folds: Vec<DVector<f64>>,
}

impl Fit {
    /// Standard error of a sum of values, each with its factor.
    pub fn spread(&self, factors: &[(usize, f64)]) -> f64 {
        let own: f64 = factors.iter().map(|(i, f)| factors.iter().map(|(j, g)| f * g * self.covariance[(*i, *j)]).sum::<f64>()).sum();
        let folds: Vec<f64> = self.of_folds.iter().map(|v| factors.iter().map(|(i, f)| f * v[*i]).sum()).collect();
        let k = folds.len() as f64;
        let mean = folds.iter().sum::<f64>() / k.max(1.0);
        let jackknife = folds.iter().map(|x| (x - mean).powi(2)).sum::<f64>() * (k - 1.0).max(0.0) / k.max(1.0);
        own.max(jackknife).max(0.0).sqrt()
    }
}
