//! The gains of the observer: the smallest m of the matrix inequality by bisection, and a solution that keeps off it.

use super::lmi::{self, Check};
use super::riccati;
use super::system::{System, SystemError};
use super::weights::Weights;
use nalgebra::{Complex, DMatrix};

/// How far the strict inequality is kept from equality: V falls so much faster, as shares of the filter's slowest pole, tried in turn.
const STRICT: [f64; 3] = [1e-4, 1e-3, 1e-5];

/// Why there are no gains.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// The model does not allow it.
    #[error(transparent)]
    System(#[from] SystemError),
    /// A number that is none, or not above 0.
    #[error("{what} must be above 0 and finite, is {value}")]
    Number {
        /// Which.
        what: &'static str,
        /// What it is.
        value: f64,
    },
    /// At the smallest m the gains are infinite.
    #[error("the back-off must be above 1, is {0}: at the smallest m itself the gains are infinite")]
    BackOff(f64),
    /// The Riccati equation has no solution that could be computed.
    #[error("the Riccati equation has no stabilising solution; the model's parameters may differ by too many orders of magnitude")]
    NoSolution,
    /// The gains do not satisfy the inequality.
    #[error(
        "the gains do not satisfy the matrix inequality (largest eigenvalue {0:.3e}); the model's parameters may differ by too many \
        orders of magnitude"
    )]
    NotVerified(f64),
}

/// Gains and how they came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// Proportional gain, states by measured quantities.
    pub k: DMatrix<f64>,
    /// Integral gain, unknown inputs by measured quantities.
    pub l: DMatrix<f64>,
    /// The m that they keep: the squared norm from (w, f') to the weighted errors is below it.
    pub m: f64,
    /// The smallest m there is.
    pub least_m: f64,
    /// P of the Lyapunov function.
    pub p: DMatrix<f64>,
    /// The inequality at P, K, L and m.
    pub check: Check,
}

impl Design {
    /// Eigenvalues of the error's motion, rad/s, slowest first.
    pub fn poles(&self, system: &System) -> Vec<Complex<f64>> {
        let mut poles: Vec<Complex<f64>> = self.error(system).complex_eigenvalues().iter().copied().collect();
        poles.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
        poles
    }

    /// The matrix of the error's motion, [[A - K C, E], [-L C, 0]].
    pub fn error(&self, system: &System) -> DMatrix<f64> {
        let (a, c) = system.augmented();
        a - stacked(&self.k, &self.l) * c
    }
}

/// K over L.
pub(super) fn stacked(k: &DMatrix<f64>, l: &DMatrix<f64>) -> DMatrix<f64> {
    let mut both = DMatrix::zeros(k.nrows() + l.nrows(), k.ncols());
    both.rows_mut(0, k.nrows()).copy_from(k);
    both.rows_mut(k.nrows(), l.nrows()).copy_from(l);
    both
}

/// The equation `A_a S + S A_a' + G Q_f^-1 G' - S (C_a' R^-1 C_a - Q_phi/m) S = 0`, R = D Q_w^-1 D', in states z, x = T z.
struct Equation {
    a: DMatrix<f64>,
    q: DMatrix<f64>,
    /// C_a' R^-1 C_a.
    seen: DMatrix<f64>,
    errors: DMatrix<f64>,
    /// C_a' R^-1.
    correct: DMatrix<f64>,
    /// T and its inverse.
    from_scaled: DMatrix<f64>,
    to_scaled: DMatrix<f64>,
}

impl Equation {
    fn new(system: &System, weights: &Weights, from_scaled: DMatrix<f64>) -> Option<Equation> {
        let (a, c) = system.augmented();
        let (n, f, _) = system.sizes();
        let to_scaled = from_scaled.clone().try_inverse()?;
        let a = &to_scaled * a * &from_scaled;
        let c = c * &from_scaled;
        let rate = to_scaled.columns(n, f);
        let q = rate * rate.transpose() / weights.rate;
        let errors = from_scaled.transpose() * weights.errors(system) * &from_scaled;
        let certain = DMatrix::from_fn(c.nrows(), c.nrows(), |i, j| if i == j { weights.noise / system.noise[i].powi(2) } else { 0.0 });
        let correct = c.transpose() * certain;
        Some(Equation { seen: &correct * c, a, q, errors, correct, from_scaled, to_scaled })
    }

    /// S in scaled states, where `V' + phi' Q_phi phi - m eps' Q_eps eps` is at most `-decay V` (1/s, about: S is about 1); `None` where there is
    /// no positive definite one.
    fn solve(&self, m: f64, decay: f64) -> Option<DMatrix<f64>> {
        let w = &self.seen - &self.errors / m - DMatrix::identity(self.a.nrows(), self.a.nrows()) * decay;
        riccati::solve(&self.a, &self.q, &w).filter(|s| s.clone().cholesky().is_some())
    }

    /// K over L.
    fn gains(&self, s: &DMatrix<f64>) -> DMatrix<f64> {
        &self.from_scaled * s * &self.correct
    }
}

/// The equation in states in which the errors of the filter for m = infinity are independent and of size 1.
fn equation(system: &System, weights: &Weights) -> Result<Equation, DesignError> {
    let numbers = [("a weight of states", weights.state), ("a weight of forces", weights.force), ("a weight of noise", weights.noise)];
    let noise = system.noise.iter().map(|d| ("noise", *d));
    for (what, value) in numbers.into_iter().chain([("a weight of rates", weights.rate)]).chain(noise) {
        if !(value.is_finite() && value > 0.0) {
            return Err(DesignError::Number { what, value });
        }
    }
    system.is_observable()?;
    let (n, f, _) = system.sizes();
    let mut equation = Equation::new(system, weights, DMatrix::identity(n + f, n + f)).ok_or(DesignError::NoSolution)?;
    for _ in 0..3 {
        let s = equation.solve(f64::INFINITY, 0.0).ok_or(DesignError::NoSolution)?;
        let root = s.cholesky().ok_or(DesignError::NoSolution)?.l();
        equation = Equation::new(system, weights, &equation.from_scaled * root).ok_or(DesignError::NoSolution)?;
    }
    Ok(equation)
}

/// The gains for m = infinity: those of the Kalman-Bucy filter for noise of intensity Q_w^-1 and a force of random rate of intensity Q_f^-1.
/// First K, then L.
///
/// # Errors
/// As [`design()`].
pub fn kalman(system: &System, weights: &Weights) -> Result<(DMatrix<f64>, DMatrix<f64>), DesignError> {
    let equation = equation(system, weights)?;
    let s = equation.solve(f64::INFINITY, 0.0).ok_or(DesignError::NoSolution)?;
    Ok(split(system, equation.gains(&s)))
}

fn split(system: &System, gains: DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let n = system.a.nrows();
    (gains.rows(0, n).into_owned(), gains.rows(n, gains.nrows() - n).into_owned())
}

/// The gains that keep `m = back_off * least_m`, and the least m there is, to 1e-9 of itself.
///
/// Completing the square in Y turns the inequality (6) into a Riccati equation in S = m P^-1, so no semidefinite program is solved: m is
/// feasible where that equation has a stabilising S > 0. At the least m the gains are infinite (1.05 times it gives a finite gain, twice it a
/// mild one), so `back_off` lies above 1. What is found is checked against the inequality itself by eigenvalues.
///
/// # Errors
/// When a weight or noise is not above 0, the back-off is not above 1, the measured signals do not determine the unknown force, or parameters are so
/// different in size that the result does not satisfy the inequality.
pub fn design(system: &System, weights: &Weights, back_off: f64) -> Result<Design, DesignError> {
    if !(back_off.is_finite() && back_off > 1.0) {
        return Err(DesignError::BackOff(back_off));
    }
    let equation = equation(system, weights)?;
    let feasible = |m: f64| equation.solve(m, 0.0).is_some();
    // In scaled states the errors of the filter are 1: its own norm is a start.
    let mut high = equation.errors.diagonal().amax().max(f64::MIN_POSITIVE);
    let mut doublings = 0;
    while !feasible(high) {
        high *= 4.0;
        doublings += 1;
        if doublings > 60 {
            return Err(DesignError::NoSolution);
        }
    }
    let mut low = high / 4.0;
    while feasible(low) {
        (low, high) = (low / 4.0, low);
        if low < f64::MIN_POSITIVE {
            return Err(DesignError::NoSolution);
        }
    }
    while high / low > 1.0 + 1e-9 {
        let middle = (low * high).sqrt();
        if feasible(middle) { high = middle } else { low = middle }
    }
    let m = back_off * high;
    let filter = equation.solve(f64::INFINITY, 0.0).ok_or(DesignError::NoSolution)?;
    let poles = (&equation.a - filter * &equation.seen).complex_eigenvalues();
    let slowest = poles.iter().map(|p| -p.re).fold(f64::INFINITY, f64::min);
    let mut largest = f64::INFINITY;
    for share in STRICT {
        let Some(s) = equation.solve(m, share * slowest) else { continue };
        let gains = equation.gains(&s);
        let inverse = s.cholesky().ok_or(DesignError::NoSolution)?.inverse();
        let p = equation.to_scaled.transpose() * (inverse * m) * &equation.to_scaled;
        let p = (&p + p.transpose()) * 0.5;
        let check = lmi::check(system, weights, &p, &(&p * &gains), m);
        if check.holds() {
            let (k, l) = split(system, gains);
            return Ok(Design { k, l, m, least_m: high, p, check });
        }
        largest = check.largest;
    }
    Err(DesignError::NotVerified(largest))
}

/// The squared norm from (w, f') to the errors (x, f), both weighted, at a frequency, rad/s: at most m of a design at every one.
pub fn norm_squared(system: &System, weights: &Weights, gains: (&DMatrix<f64>, &DMatrix<f64>), omega: f64) -> f64 {
    let (a, c) = system.augmented();
    let (n, f, outputs) = system.sizes();
    let both = stacked(gains.0, gains.1);
    let error = a - &both * c;
    let size = n + f;
    let pencil = DMatrix::from_fn(size, size, |i, j| Complex::new(-error[(i, j)], if i == j { omega } else { 0.0 }));
    let weight = weights.errors(system);
    let drive = DMatrix::from_fn(size, outputs + f, |i, j| {
        let entry = if j < outputs {
            -both[(i, j)] * system.noise[j] / weights.noise.sqrt()
        } else if i == n + j - outputs {
            1.0 / weights.rate.sqrt()
        } else {
            0.0
        };
        Complex::new(entry, 0.0)
    });
    let Some(answer) = pencil.lu().solve(&drive) else { return f64::INFINITY };
    let weighted = DMatrix::from_fn(size, outputs + f, |i, j| answer[(i, j)] * weight[(i, i)].sqrt());
    weighted.svd(false, false).singular_values.max().powi(2)
}
