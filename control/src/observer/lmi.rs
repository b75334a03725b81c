//! The matrix inequality that the gains have to satisfy, checked by eigenvalues.

use super::{System, Weights};
use nalgebra::{DMatrix, SymmetricEigen};

/// The matrix of the inequality: Blumenschein et al., (5) and (6), with Y = P [K; L] and the sign of m that the scan lost:
///
/// ```text
/// [ A_a'P + P A_a - C_a'Y' - Y C_a + Q_phi,   -Y D,     P G    ]
/// [ -D'Y',                                    -m Q_w,   0      ]  < 0,   G = [0; I]
/// [ G'P,                                       0,      -m Q_f  ]
/// ```
///
/// `p` is square over states and unknown inputs, `y` is as high and as wide as there are measured quantities.
pub fn matrix(system: &System, weights: &Weights, p: &DMatrix<f64>, y: &DMatrix<f64>, m: f64) -> DMatrix<f64> {
    let (a, c) = system.augmented();
    let half = p * a - y * c;
    joined(
        system,
        weights,
        &half + half.transpose() + weights.errors(system),
        y,
        &p.columns(system.a.nrows(), system.e.ncols()).into_owned(),
        m,
    )
}

/// The blocks: the first one, Y, and P G.
fn joined(system: &System, weights: &Weights, first: DMatrix<f64>, y: &DMatrix<f64>, pg: &DMatrix<f64>, m: f64) -> DMatrix<f64> {
    let (whole, outputs, f) = (first.nrows(), y.ncols(), pg.ncols());
    let mut side = DMatrix::zeros(whole, outputs + f);
    for (j, noise) in system.noise.iter().enumerate() {
        side.set_column(j, &(y.column(j) * -noise));
    }
    side.columns_mut(outputs, f).copy_from(pg);
    let mut all = DMatrix::zeros(whole + outputs + f, whole + outputs + f);
    all.view_mut((0, 0), (whole, whole)).copy_from(&first);
    all.view_mut((0, whole), (whole, outputs + f)).copy_from(&side);
    all.view_mut((whole, 0), (outputs + f, whole)).copy_from(&side.transpose());
    for j in 0..outputs + f {
        all[(whole + j, whole + j)] = -m * if j < outputs { weights.noise } else { weights.rate };
    }
    all
}

/// What the eigenvalues say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Check {
    /// Largest eigenvalue of the inequality's matrix in states in which P is 1, rows and columns then scaled alike by the root of their diagonal:
    /// a congruence, which changes no sign. No unit.
    pub largest: f64,
    /// Smallest eigenvalue of P, rows and columns scaled by the root of its diagonal. No unit.
    pub least_of_p: f64,
}

impl Check {
    /// Whether the inequality holds and P is positive definite.
    pub fn holds(&self) -> bool {
        self.largest < 0.0 && self.least_of_p > 0.0
    }
}

/// Checks P, Y and m: see [`matrix()`].
pub fn check(system: &System, weights: &Weights, p: &DMatrix<f64>, y: &DMatrix<f64>, m: f64) -> Check {
    let least_of_p = SymmetricEigen::new(scaled(p.clone())).eigenvalues.min();
    // In states z = R' x, P = R R', the matrix is well conditioned, and rounding is far below what it is off zero.
    let Some(root) = p.clone().cholesky().map(|c| c.l()) else { return Check { largest: f64::INFINITY, least_of_p } };
    let Some(back) = root.transpose().try_inverse() else { return Check { largest: f64::INFINITY, least_of_p } };
    let (a, c) = system.augmented();
    let (n, f, _) = system.sizes();
    let y = back.transpose() * y;
    let half = root.transpose() * a * &back - &y * c * &back;
    let errors = back.transpose() * weights.errors(system) * &back;
    let pg = root.rows(n, f).transpose();
    let largest = SymmetricEigen::new(scaled(joined(system, weights, &half + half.transpose() + errors, &y, &pg, m))).eigenvalues.max();
    Check { largest, least_of_p }
}

fn scaled(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let root: Vec<f64> = (0..matrix.nrows()).map(|i| matrix[(i, i)].abs().sqrt().max(f64::MIN_POSITIVE.sqrt())).collect();
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| 0.5 * (matrix[(i, j)] + matrix[(j, i)]) / (root[i] * root[j]))
}
