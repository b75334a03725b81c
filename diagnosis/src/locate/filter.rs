//! Kalman filter for the deviation equations with the unknown as a state.
//!
//! The gain is the steady one (by doubling of the Riccati equation), so a sample costs two small matrix-vector products.

use super::equations::Equations;
use crate::tuning::tuning;
use nalgebra::{DMatrix, DVector};

/// The deviation of a channel in discrete time, in scaled states and outputs divided by their noise standard deviation.
pub(super) struct System {
    /// States and outputs.
    pub n: usize,
    pub p: usize,
    /// State after a sample over the state before it.
    pub f: DMatrix<f64>,
    /// Outputs over the state.
    pub h: DMatrix<f64>,
    /// Process noise for a unit intensity of the unknown's last derivative.
    q: DMatrix<f64>,
    /// Process noise of the errors of nonlinear elements.
    q_force_errors: DMatrix<f64>,
    /// Known forces, held over a sample: on the state, on the outputs.
    gamma: DMatrix<f64>,
    d: DMatrix<f64>,
    /// What a known value of the unknown, held over a sample, does.
    gamma_unknown: DVector<f64>,
    d_unknown: DVector<f64>,
    /// Index of the unknown in the state.
    pub unknown: usize,
    /// Unit in which each state is counted.
    pub scale: DVector<f64>,
    /// Noise of each output, in its unit.
    pub noise: Vec<f64>,
}

/// The filter with its steady gain.
pub(super) struct Steady {
    /// Covariance of the predicted state.
    pub predicted: DMatrix<f64>,
    pub gains: Gains,
}

/// What one sample takes: Kalman gain, inverse of the innovation covariance, and the logarithm of its determinant.
#[derive(Clone)]
pub(super) struct Gains {
    pub gain: DMatrix<f64>,
    pub inverse: DMatrix<f64>,
    pub log_det: f64,
}

/// The known data of a run: residuals of the nominal model (a column for each output row), forces of nonlinear elements beyond their linear part, and a
/// known part of the unknown. The latter two may be empty.
#[derive(Clone, Copy)]
pub(super) struct Data<'a> {
    pub residual: &'a [Vec<f64>],
    pub forces: &'a [Vec<f64>],
    pub known: &'a [f64],
}

impl System {
    /// From the equations; `scales` are typical displacement, speed and value of the unknown, `noise` that of each output row.
    pub fn of(equations: &Equations, period: f64, scales: [f64; 3], noise: &[f64]) -> Option<System> {
        let (n, p) = (equations.a.nrows(), equations.h.nrows());
        let bodies = equations.unknown / 2;
        let order = equations.order;
        // Derivatives of the unknown are measured per sample time, or the covariance would mix quantities of very different size.
        let scale = DVector::from_fn(n, |i, _| match i {
            i if i < bodies => scales[0],
            i if i < 2 * bodies => scales[1],
            i if i < 2 * bodies + order => scales[2] / (period * tuning().locate.slow).powi((i - 2 * bodies) as i32),
            i => equations.force_errors[i - 2 * bodies - order],
        });
        let a = DMatrix::from_fn(n, n, |i, j| equations.a[(i, j)] * scale[j] / scale[i]);
        let b = DMatrix::from_fn(n, equations.b.ncols(), |i, j| equations.b[(i, j)] / scale[i]);
        let h = DMatrix::from_fn(p, n, |i, j| equations.h[(i, j)] * scale[j] / noise[i]);
        let d = DMatrix::from_fn(p, equations.d.ncols(), |i, j| equations.d[(i, j)] / noise[i]);
        // Held forces: the integral of the exponential. The unknown's own column gives that of a known value.
        let mut augmented = DMatrix::zeros(n + b.ncols() + 1, n + b.ncols() + 1);
        augmented.view_mut((0, 0), (n, n)).copy_from(&a);
        augmented.view_mut((0, n), (n, b.ncols())).copy_from(&b);
        for i in 0..equations.unknown {
            augmented[(i, n + b.ncols())] = a[(i, equations.unknown)] / scale[equations.unknown];
        }
        let solution = (augmented * period).exp();
        let f = solution.view((0, 0), (n, n)).into_owned();
        let gamma = solution.view((0, n), (n, b.ncols())).into_owned();
        let gamma_unknown = solution.column(n + b.ncols()).rows(0, n).into_owned();
        let d_unknown = h.column(equations.unknown) / scale[equations.unknown];
        // Van Loan 1978: the noise that a white last derivative leaves after a sample. Intensity 1 moves the unknown by its scale in tuning().locate.slow samples.
        let last = equations.unknown + order - 1;
        let noise_of = |power: &dyn Fn(usize) -> f64| {
            let mut loan = DMatrix::zeros(2 * n, 2 * n);
            loan.view_mut((0, 0), (n, n)).copy_from(&(-&a * period));
            loan.view_mut((n, n), (n, n)).copy_from(&(a.transpose() * period));
            (0..n).for_each(|i| loan[(i, n + i)] = power(i));
            let loan = loan.exp();
            let q = loan.view((n, n), (n, n)).transpose() * loan.view((0, n), (n, n));
            (&q + q.transpose()) * 0.5
        };
        let q = noise_of(&|i| if i == last { 1.0 / tuning().locate.slow } else { 0.0 });
        // An error of standard deviation 1 that is forgotten at a rate needs twice that rate of noise.
        let q_force_errors = noise_of(&|i| if i > last { -2.0 * a[(i, i)] * period } else { 0.0 });
        let good = f.iter().chain(q.iter()).chain(q_force_errors.iter()).chain(gamma.iter()).chain(h.iter()).all(|x| x.is_finite());
        good.then(|| System {
            n,
            p,
            f,
            h,
            q,
            q_force_errors,
            gamma,
            d,
            gamma_unknown,
            d_unknown,
            unknown: equations.unknown,
            scale,
            noise: noise.to_vec(),
        })
    }

    /// Predicted covariance that the filter settles at: doubling of the Riccati equation (Anderson 1978), each pass twice as far in time.
    pub fn steady(&self, intensity: f64) -> Option<Steady> {
        let mut a = self.f.transpose();
        let mut g = self.h.transpose() * &self.h;
        let mut x = self.process_noise(intensity);
        for _ in 0..DOUBLINGS {
            let lu = (DMatrix::identity(self.n, self.n) + &g * &x).lu();
            let (wa, wg) = (lu.solve(&a)?, lu.solve(&g)?);
            let next = &x + a.transpose() * &x * &wa;
            g += &a * wg * a.transpose();
            a = &a * wa;
            let change = (&next - &x).amax();
            x = (&next + next.transpose()) * 0.5;
            if change <= 1e-10 * x.amax() {
                break;
            }
        }
        let s = DMatrix::identity(self.p, self.p) + &self.h * &x * self.h.transpose();
        let cholesky = s.cholesky()?;
        let log_det = 2.0 * cholesky.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        let inverse = cholesky.inverse();
        let gain = &x * self.h.transpose() * &inverse;
        let good = x.iter().chain(gain.iter()).all(|v| v.is_finite()) && log_det.is_finite();
        good.then_some(Steady { predicted: x, gains: Gains { gain, inverse, log_det } })
    }

    /// Log-likelihood of a run for an intensity of the unknown, with the steady gain.
    pub fn log_likelihood(&self, intensity: f64, data: Data) -> Option<f64> {
        let steady = self.steady(intensity)?;
        let mut pass = FilterPass::new(self, &steady.gains.gain);
        let (mut sum, len) = (0.0, data.residual.first()?.len());
        let mut error = vec![0.0; self.p];
        for k in 0..len {
            pass.innovation(self, data, k, &mut error);
            sum += quadratic(&steady.gains.inverse, &error);
            pass.advance(self, data, k, &error);
        }
        let constant = steady.gains.log_det + self.log_likelihood_constant();
        let value = -0.5 * (sum + len as f64 * constant);
        value.is_finite().then_some(value)
    }

    /// Covariance of the process noise over a sample.
    pub fn process_noise(&self, intensity: f64) -> DMatrix<f64> {
        &self.q * intensity + &self.q_force_errors
    }

    /// What the outputs' noise adds to minus twice the log-likelihood of a sample.
    pub fn log_likelihood_constant(&self) -> f64 {
        self.noise.iter().map(|r| 2.0 * r.ln() + std::f64::consts::TAU.ln()).sum()
    }

    /// Gains for a covariance of the predicted state.
    pub fn gains(&self, covariance: &DMatrix<f64>) -> Option<Gains> {
        let ph = covariance * self.h.transpose();
        let s = DMatrix::identity(self.p, self.p) + &self.h * &ph;
        let cholesky = s.cholesky()?;
        let log_det = 2.0 * cholesky.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        let inverse = cholesky.inverse();
        Some(Gains { gain: ph * &inverse, inverse, log_det })
    }
}

/// The filter sample by sample, with matrices laid out by rows.
pub(super) struct FilterPass {
    pub state: Vec<f64>,
    corrected: Vec<f64>,
    f: Vec<f64>,
    h: Vec<f64>,
    gain: Vec<f64>,
}

impl FilterPass {
    pub fn new(system: &System, gain: &DMatrix<f64>) -> FilterPass {
        let n = system.n;
        FilterPass { state: vec![0.0; n], corrected: vec![0.0; n], f: row_major(&system.f), h: row_major(&system.h), gain: row_major(gain) }
    }

    pub fn set_gain(&mut self, gain: &DMatrix<f64>) {
        self.gain.clear();
        self.gain.extend(gain.row_iter().flat_map(|r| r.iter().copied().collect::<Vec<_>>()));
    }

    /// Difference of what was read and predicted at sample `k`, in noise standard deviations.
    pub fn innovation(&self, system: &System, data: Data, k: usize, error: &mut [f64]) {
        let n = system.n;
        for (i, e) in error.iter_mut().enumerate() {
            *e = data.residual[i][k] / system.noise[i] - dot(&self.h[i * n..(i + 1) * n], &self.state);
            for (j, force) in data.forces.iter().enumerate() {
                *e -= system.d[(i, j)] * force[k];
            }
            if let Some(known) = data.known.get(k) {
                *e -= system.d_unknown[i] * known;
            }
        }
    }

    #[inline]
    /// Corrects the state by the innovation, and predicts the next sample.
    pub fn advance(&mut self, system: &System, data: Data, k: usize, error: &[f64]) {
        let (n, p) = (system.n, system.p);
        for i in 0..n {
            self.corrected[i] = self.state[i] + dot(&self.gain[i * p..(i + 1) * p], error);
        }
        for i in 0..n {
            self.state[i] = dot(&self.f[i * n..(i + 1) * n], &self.corrected);
        }
        // Between samples a known force is taken as the mean of its ends.
        let middle = |column: &[f64]| 0.5 * (column[k] + column.get(k + 1).copied().unwrap_or(column[k]));
        for (j, force) in data.forces.iter().enumerate() {
            let force = middle(force);
            for i in 0..n {
                self.state[i] += system.gamma[(i, j)] * force;
            }
        }
        if !data.known.is_empty() {
            let known = middle(data.known);
            for i in 0..n {
                self.state[i] += system.gamma_unknown[i] * known;
            }
        }
    }
}

pub(super) fn row_major(m: &DMatrix<f64>) -> Vec<f64> {
    m.transpose().iter().copied().collect()
}

#[inline]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

pub(super) fn quadratic(m: &DMatrix<f64>, v: &[f64]) -> f64 {
    match v {
        [x] => m[(0, 0)] * x * x,
        _ => (0..v.len()).map(|i| v[i] * (0..v.len()).map(|j| m[(i, j)] * v[j]).sum::<f64>()).sum(),
    }
}

/// Doublings at most: 2^18 samples.
pub(super) const DOUBLINGS: usize = 18;
