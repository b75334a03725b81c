//! Kalman filter and fixed-interval smoother for the deviation equations with an unknown force as a state.
//!
//! The gain is the steady one (by doubling of the Riccati equation), so a sample costs two small matrix-vector products. Where the
//! unknown may jump, the covariance is carried along instead. The smoother is the one of de Jong 1989 in the form of Durbin &
//! Koopman 2012, section 4.4: it inverts nothing but the innovation covariance.

use super::channel::Equations;
use nalgebra::{DMatrix, DVector};

/// A channel's deviation in discrete time, in scaled states and outputs divided by their noise.
pub(super) struct System {
    n: usize,
    p: usize,
    f: DMatrix<f64>,
    h: DMatrix<f64>,
    /// Process noise for a unit intensity of the unknown's last derivative.
    q: DMatrix<f64>,
    /// Process noise of the errors of nonlinear elements.
    of_errors: DMatrix<f64>,
    /// Known forces, held over a sample: on the state, on the outputs.
    gamma: DMatrix<f64>,
    d: DMatrix<f64>,
    /// What a known value of the unknown, held over a sample, does.
    gamma_value: DVector<f64>,
    d_value: DVector<f64>,
    value: usize,
    scale: DVector<f64>,
    /// Noise of each output, in its unit.
    noise: Vec<f64>,
}

/// Steady filter.
struct Steady {
    predicted: DMatrix<f64>,
    gain: DMatrix<f64>,
    inverse: DMatrix<f64>,
    log_det: f64,
}

/// A run to be explained: residuals (a column for each output row), forces of nonlinear elements beyond the linear ones, and a known part of
/// the unknown; the latter two may be empty.
#[derive(Clone, Copy)]
pub(super) struct Data<'a> {
    pub residual: &'a [Vec<f64>],
    pub forces: &'a [Vec<f64>],
    pub known: &'a [f64],
}

/// The smoothed state.
pub(super) struct Smoothed {
    /// The unknown, known part included, in N, m or the output's unit.
    pub value: Vec<f64>,
    /// Its standard deviation at each sample.
    pub deviation: Vec<f64>,
    /// Free positions and velocities, column by column, for [`System::row`].
    states: Vec<f64>,
    n: usize,
    pub log_likelihood: f64,
}

impl Smoothed {
    /// A linear reading of the state over time; `row` is over the states of the equations.
    pub fn reading(&self, row: &DVector<f64>) -> Vec<f64> {
        let used: Vec<(usize, f64)> = row.iter().copied().enumerate().filter(|(_, c)| *c != 0.0).collect();
        self.states.chunks_exact(self.n).map(|s| used.iter().map(|(i, c)| c * s[*i]).sum()).collect()
    }
}

impl System {
    /// From the equations; `scales` are typical displacement, speed and value of the unknown, `noise` that of each output row.
    pub fn of(equations: &Equations, period: f64, scales: [f64; 3], noise: &[f64]) -> Option<System> {
        let (n, p) = (equations.a.nrows(), equations.h.nrows());
        let bodies = equations.value / 2;
        let chain = equations.chain;
        // Derivatives of the unknown are measured per sample time, or the covariance would mix numbers of very different size.
        let scale = DVector::from_fn(n, |i, _| match i {
            i if i < bodies => scales[0],
            i if i < 2 * bodies => scales[1],
            i if i < 2 * bodies + chain => scales[2] / (period * SLOW).powi((i - 2 * bodies) as i32),
            i => equations.errors[i - 2 * bodies - chain],
        });
        let a = DMatrix::from_fn(n, n, |i, j| equations.a[(i, j)] * scale[j] / scale[i]);
        let b = DMatrix::from_fn(n, equations.b.ncols(), |i, j| equations.b[(i, j)] / scale[i]);
        let h = DMatrix::from_fn(p, n, |i, j| equations.h[(i, j)] * scale[j] / noise[i]);
        let d = DMatrix::from_fn(p, equations.d.ncols(), |i, j| equations.d[(i, j)] / noise[i]);
        // Held forces: the integral of the exponential. The unknown's own column gives that of a known value.
        let mut augmented = DMatrix::zeros(n + b.ncols() + 1, n + b.ncols() + 1);
        augmented.view_mut((0, 0), (n, n)).copy_from(&a);
        augmented.view_mut((0, n), (n, b.ncols())).copy_from(&b);
        for i in 0..equations.value {
            augmented[(i, n + b.ncols())] = a[(i, equations.value)] / scale[equations.value];
        }
        let solution = (augmented * period).exp();
        let f = solution.view((0, 0), (n, n)).into_owned();
        let gamma = solution.view((0, n), (n, b.ncols())).into_owned();
        let gamma_value = solution.column(n + b.ncols()).rows(0, n).into_owned();
        let d_value = h.column(equations.value) / scale[equations.value];
        // Van Loan 1978: the noise that a white last derivative leaves after a sample. Intensity 1 moves the unknown by its scale in SLOW samples.
        let last = equations.value + chain - 1;
        let noise_of = |power: &dyn Fn(usize) -> f64| {
            let mut loan = DMatrix::zeros(2 * n, 2 * n);
            loan.view_mut((0, 0), (n, n)).copy_from(&(-&a * period));
            loan.view_mut((n, n), (n, n)).copy_from(&(a.transpose() * period));
            (0..n).for_each(|i| loan[(i, n + i)] = power(i));
            let loan = loan.exp();
            let q = loan.view((n, n), (n, n)).transpose() * loan.view((0, n), (n, n));
            (&q + q.transpose()) * 0.5
        };
        let q = noise_of(&|i| if i == last { 1.0 / SLOW } else { 0.0 });
        // An error of standard deviation 1 that is forgotten at a rate needs twice that rate of noise.
        let of_errors = noise_of(&|i| if i > last { -2.0 * a[(i, i)] * period } else { 0.0 });
        let good = f.iter().chain(q.iter()).chain(of_errors.iter()).chain(gamma.iter()).chain(h.iter()).all(|x| x.is_finite());
        good.then(|| System {
            n,
            p,
            f,
            h,
            q,
            of_errors,
            gamma,
            d,
            gamma_value,
            d_value,
            value: equations.value,
            scale,
            noise: noise.to_vec(),
        })
    }

    /// Predicted covariance that the filter settles at: doubling of the Riccati equation (Anderson 1978), each pass twice as far in time.
    fn steady(&self, intensity: f64) -> Option<Steady> {
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
        good.then_some(Steady { predicted: x, gain, inverse, log_det })
    }

    /// Log-likelihood of a run for an intensity of the unknown, with the steady gain.
    pub fn log_likelihood(&self, intensity: f64, data: Data) -> Option<f64> {
        let steady = self.steady(intensity)?;
        let mut pass = Pass::new(self, &steady.gain);
        let (mut sum, len) = (0.0, data.residual.first()?.len());
        let mut error = vec![0.0; self.p];
        for k in 0..len {
            pass.innovation(self, data, k, &mut error);
            sum += quadratic(&steady.inverse, &error);
            pass.advance(self, data, k, &error);
        }
        let constant = steady.log_det + self.noise.iter().map(|r| 2.0 * r.ln() + std::f64::consts::TAU.ln()).sum::<f64>();
        let value = -0.5 * (sum + len as f64 * constant);
        value.is_finite().then_some(value)
    }

    /// The smoothed state of a run. At the samples in `jumps` the unknown may change by about `jump` (in its unit) at once.
    pub fn smooth(&self, intensity: f64, data: Data, jumps: &[usize], jump: f64) -> Option<Smoothed> {
        let steady = self.steady(intensity)?;
        let len = data.residual.first()?.len();
        if jumps.is_empty() || len * self.n * self.n > LARGEST {
            self.smooth_steadily(&steady, data, len)
        } else {
            self.smooth_with_jumps(&steady, self.process_noise(intensity), data, len, jumps, jump)
        }
    }

    fn process_noise(&self, intensity: f64) -> DMatrix<f64> {
        &self.q * intensity + &self.of_errors
    }

    fn constant(&self) -> f64 {
        self.noise.iter().map(|r| 2.0 * r.ln() + std::f64::consts::TAU.ln()).sum()
    }

    fn smooth_steadily(&self, steady: &Steady, data: Data, len: usize) -> Option<Smoothed> {
        let (n, p) = (self.n, self.p);
        let mut pass = Pass::new(self, &steady.gain);
        let mut predicted = vec![0.0; len * n];
        let mut errors = vec![0.0; len * p];
        let mut sum = 0.0;
        for k in 0..len {
            let error = &mut errors[k * p..(k + 1) * p];
            predicted[k * n..(k + 1) * n].copy_from_slice(&pass.state);
            pass.innovation(self, data, k, error);
            sum += quadratic(&steady.inverse, error);
            pass.advance(self, data, k, error);
        }
        // Backwards: r = H' S^-1 e + L' r, with L = F (I - K H).
        let l = &self.f * (DMatrix::identity(n, n) - &steady.gain * &self.h);
        let lt: Vec<f64> = l.iter().copied().collect(); // columns of L are the rows of L'
        let hs: Vec<f64> = row_major(&(self.h.transpose() * &steady.inverse));
        let pr: Vec<f64> = row_major(&steady.predicted);
        let (mut r, mut next) = (vec![0.0; n], vec![0.0; n]);
        for k in (0..len).rev() {
            let error = &errors[k * p..(k + 1) * p];
            for i in 0..n {
                next[i] = dot(&lt[i * n..(i + 1) * n], &r) + dot(&hs[i * p..(i + 1) * p], error);
            }
            std::mem::swap(&mut r, &mut next);
            let state = &mut predicted[k * n..(k + 1) * n];
            for i in 0..n {
                state[i] += dot(&pr[i * n..(i + 1) * n], &r);
            }
        }
        // N = H' S^-1 H + L' N L, by doubling; the smoothed covariance is P - P N P.
        let mut information = self.h.transpose() * &steady.inverse * &self.h;
        let mut carried = l;
        for _ in 0..DOUBLINGS {
            let more = carried.transpose() * &information * &carried;
            let change = more.amax();
            information += more;
            carried = &carried * &carried;
            if change <= 1e-10 * information.amax() {
                break;
            }
        }
        let covariance = &steady.predicted - &steady.predicted * information * &steady.predicted;
        let deviation = covariance[(self.value, self.value)].max(0.0).sqrt() * self.scale[self.value];
        let log_likelihood = -0.5 * (sum + len as f64 * (steady.log_det + self.constant()));
        Some(self.finish(predicted, vec![deviation; len], data, log_likelihood))
    }

    fn smooth_with_jumps(&self, steady: &Steady, q: DMatrix<f64>, data: Data, len: usize, jumps: &[usize], jump: f64) -> Option<Smoothed> {
        let (n, p) = (self.n, self.p);
        let extra = (jump / self.scale[self.value]).powi(2);
        let mut is_jump = vec![false; len];
        jumps.iter().for_each(|k| {
            if let Some(flag) = is_jump.get_mut(*k) {
                *flag = true;
            }
        });
        let mut covariance = steady.predicted.clone();
        let mut settled = true;
        let mut pass = Pass::new(self, &steady.gain);
        let mut now = Gains { gain: steady.gain.clone(), inverse: steady.inverse.clone(), log_det: steady.log_det };
        let (mut states, mut errors) = (vec![0.0; len * n], vec![0.0; len * p]);
        // Covariance and gains of the samples where they are not the steady ones.
        let mut special: Vec<Option<Box<Unsettled>>> = (0..len).map(|_| None).collect();
        let mut sum = 0.0;
        for k in 0..len {
            if is_jump[k] {
                covariance[(self.value, self.value)] += extra;
                settled = false;
            }
            if !settled {
                now = self.gains(&covariance)?;
                pass.set_gain(&now.gain);
                special[k] = Some(Box::new(Unsettled { covariance: covariance.clone(), gains: now.clone() }));
            }
            let error = &mut errors[k * p..(k + 1) * p];
            states[k * n..(k + 1) * n].copy_from_slice(&pass.state);
            pass.innovation(self, data, k, error);
            sum += quadratic(&now.inverse, error) + now.log_det;
            pass.advance(self, data, k, error);
            if !settled {
                let kept = DMatrix::identity(n, n) - &now.gain * &self.h;
                let next = &self.f * (&kept * &covariance) * self.f.transpose() + &q;
                covariance = (&next + next.transpose()) * 0.5;
                let distance = (&covariance - &steady.predicted).amax();
                if distance <= 1e-3 * steady.predicted.amax() {
                    settled = true;
                    covariance.copy_from(&steady.predicted);
                    now = Gains { gain: steady.gain.clone(), inverse: steady.inverse.clone(), log_det: steady.log_det };
                    pass.set_gain(&now.gain);
                }
            }
        }
        let usual = Gains { gain: steady.gain.clone(), inverse: steady.inverse.clone(), log_det: steady.log_det };
        let usual_l = &self.f * (DMatrix::identity(n, n) - &usual.gain * &self.h);
        let usual_h = self.h.transpose() * &usual.inverse;
        let mut r = DVector::zeros(n);
        let mut information = DMatrix::zeros(n, n);
        let mut deviations = vec![0.0; len];
        let (mut steady_since, mut last) = (0, 0.0);
        for k in (0..len).rev() {
            let error = DVector::from_column_slice(&errors[k * p..(k + 1) * p]);
            let mut at = |covariance: &DMatrix<f64>, l: &DMatrix<f64>, hs: DMatrix<f64>, skip: bool| {
                r = l.transpose() * &r + &hs * &error;
                let state = covariance * &r;
                for i in 0..n {
                    states[k * n + i] += state[i];
                }
                if !skip {
                    information = l.transpose() * &information * l + &hs * &self.h;
                    let row = covariance.row(self.value);
                    let reduced = (row * &information * row.transpose())[(0, 0)];
                    last = (covariance[(self.value, self.value)] - reduced).max(0.0).sqrt() * self.scale[self.value];
                }
                deviations[k] = last;
            };
            match &special[k] {
                Some(boxed) => {
                    let Unsettled { covariance, gains } = boxed.as_ref();
                    let l = &self.f * (DMatrix::identity(n, n) - &gains.gain * &self.h);
                    at(covariance, &l, self.h.transpose() * &gains.inverse, false);
                    steady_since = 0;
                }
                None => {
                    at(&steady.predicted, &usual_l, usual_h.clone(), steady_since > SETTLED);
                    steady_since += 1;
                }
            }
        }
        let log_likelihood = -0.5 * (sum + len as f64 * self.constant());
        Some(self.finish(states, deviations, data, log_likelihood))
    }

    fn gains(&self, covariance: &DMatrix<f64>) -> Option<Gains> {
        let ph = covariance * self.h.transpose();
        let s = DMatrix::identity(self.p, self.p) + &self.h * &ph;
        let cholesky = s.cholesky()?;
        let log_det = 2.0 * cholesky.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        let inverse = cholesky.inverse();
        Some(Gains { gain: ph * &inverse, inverse, log_det })
    }

    fn finish(&self, mut states: Vec<f64>, deviation: Vec<f64>, data: Data, log_likelihood: f64) -> Smoothed {
        for state in states.chunks_exact_mut(self.n) {
            state.iter_mut().zip(self.scale.iter()).for_each(|(x, s)| *x *= s);
        }
        let value =
            states.chunks_exact(self.n).enumerate().map(|(k, s)| s[self.value] + data.known.get(k).copied().unwrap_or(0.0)).collect();
        Smoothed { value, deviation, states, n: self.n, log_likelihood }
    }
}

#[cfg(test)]
impl System {
    /// Posterior mean and standard deviation of the unknown, and log-likelihood, from the covariance of all samples at once.
    pub fn dense(&self, intensity: f64, residual: &[Vec<f64>], jumps: &[usize], jump: f64) -> (DVector<f64>, Vec<f64>, f64) {
        let (n, p, len) = (self.n, self.p, residual[0].len());
        let q = self.process_noise(intensity);
        // Each state is a sum of the initial state and the noises before it.
        let mut state = vec![DMatrix::<f64>::zeros(n, n * len); len];
        let mut prior = DMatrix::<f64>::zeros(n * len, n * len);
        for k in 0..len {
            let mut own = if k == 0 { self.steady(intensity).expect("steady").predicted } else { q.clone() };
            if jumps.contains(&k) {
                own[(self.value, self.value)] += (jump / self.scale[self.value]).powi(2);
            }
            prior.view_mut((k * n, k * n), (n, n)).copy_from(&own);
            if k > 0 {
                state[k] = &self.f * &state[k - 1];
            }
            state[k].view_mut((0, k * n), (n, n)).fill_with_identity();
        }
        let mut reads = DMatrix::<f64>::zeros(p * len, n * len);
        let mut y = DVector::<f64>::zeros(p * len);
        for k in 0..len {
            reads.rows_mut(k * p, p).copy_from(&(&self.h * &state[k]));
            for r in 0..p {
                y[k * p + r] = residual[r][k] / self.noise[r];
            }
        }
        let covariance = &reads * &prior * reads.transpose() + DMatrix::identity(p * len, p * len);
        let factor = covariance.cholesky().expect("positive definite");
        let weights = factor.solve(&y);
        let scale = self.scale[self.value];
        let row = |k: usize| state[k].row(self.value) * &prior;
        let mean = DVector::from_fn(len, |k, _| (row(k) * reads.transpose() * &weights)[0] * scale);
        let deviation = (0..len).map(|k| {
            let cross = row(k) * reads.transpose();
            let own = (row(k) * state[k].row(self.value).transpose())[0];
            (own - (&cross * factor.solve(&cross.transpose()))[0]).max(0.0).sqrt() * scale
        });
        let log_det = 2.0 * factor.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        (mean, deviation.collect(), -0.5 * (y.dot(&weights) + log_det + len as f64 * self.constant()))
    }
}

#[derive(Clone)]
struct Gains {
    gain: DMatrix<f64>,
    inverse: DMatrix<f64>,
    log_det: f64,
}

/// A sample at which the covariance is not the steady one.
struct Unsettled {
    covariance: DMatrix<f64>,
    gains: Gains,
}

/// The filter on its way, with matrices laid out by rows.
struct Pass {
    state: Vec<f64>,
    corrected: Vec<f64>,
    f: Vec<f64>,
    h: Vec<f64>,
    gain: Vec<f64>,
}

impl Pass {
    fn new(system: &System, gain: &DMatrix<f64>) -> Pass {
        let n = system.n;
        Pass { state: vec![0.0; n], corrected: vec![0.0; n], f: row_major(&system.f), h: row_major(&system.h), gain: row_major(gain) }
    }

    fn set_gain(&mut self, gain: &DMatrix<f64>) {
        self.gain.clear();
        self.gain.extend(gain.row_iter().flat_map(|r| r.iter().copied().collect::<Vec<_>>()));
    }

    #[inline]
    fn innovation(&self, system: &System, data: Data, k: usize, error: &mut [f64]) {
        let n = system.n;
        for (i, e) in error.iter_mut().enumerate() {
            *e = data.residual[i][k] / system.noise[i] - dot(&self.h[i * n..(i + 1) * n], &self.state);
            for (j, force) in data.forces.iter().enumerate() {
                *e -= system.d[(i, j)] * force[k];
            }
            if let Some(known) = data.known.get(k) {
                *e -= system.d_value[i] * known;
            }
        }
    }

    #[inline]
    fn advance(&mut self, system: &System, data: Data, k: usize, error: &[f64]) {
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
                self.state[i] += system.gamma_value[i] * known;
            }
        }
    }
}

fn row_major(m: &DMatrix<f64>) -> Vec<f64> {
    m.transpose().iter().copied().collect()
}

#[inline]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn quadratic(m: &DMatrix<f64>, v: &[f64]) -> f64 {
    match v {
        [x] => m[(0, 0)] * x * x,
        _ => (0..v.len()).map(|i| v[i] * (0..v.len()).map(|j| m[(i, j)] * v[j]).sum::<f64>()).sum(),
    }
}

/// Samples in which the unknown moves by its scale at unit intensity.
const SLOW: f64 = 100.0;
/// Doublings at most: 2^18 samples.
const DOUBLINGS: usize = 18;
/// Numbers that the covariances of a run may take; longer runs are smoothed with the steady gain alone.
const LARGEST: usize = 8_000_000;
/// Samples after which a backward covariance counts as settled.
const SETTLED: usize = 400;
