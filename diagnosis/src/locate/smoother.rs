//! Fixed-interval smoother for the deviation equations with the unknown as a state.
//!
//! It is the one of de Jong 1989 in the form of Durbin & Koopman 2012, section 4.4: it inverts nothing but the innovation covariance. Where the
//! unknown may jump, the covariance is carried along instead of the steady one.

use super::filter::{DOUBLINGS, Data, FilterPass, Gains, Steady, System, dot, quadratic, row_major};
use crate::tuning::tuning;
use nalgebra::{DMatrix, DVector};

/// The smoothed state.
pub(super) struct Smoothed {
    /// The unknown, known part included, in N, m or the output's unit.
    pub value: Vec<f64>,
    /// Its standard deviation at each sample.
    pub deviation: Vec<f64>,
    /// Free positions and velocities and the other states, sample by sample; see [`Smoothed::reading`].
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

/// What the forward pass leaves for the backward one.
struct Forward {
    /// Predicted states and innovations, sample by sample.
    states: Vec<f64>,
    errors: Vec<f64>,
    /// Covariance and gains of the samples where they are not the steady ones.
    transients: Vec<Option<Box<Transient>>>,
    /// Minus twice the log-likelihood, its constant part apart.
    sum: f64,
}

/// A sample at which the covariance is not the steady one.
struct Transient {
    covariance: DMatrix<f64>,
    gains: Gains,
}

impl System {
    /// The smoothed state of a run. At the samples in `jumps` the unknown may change by about `jump` (in its unit) at once.
    pub fn smooth(&self, intensity: f64, data: Data, jumps: &[usize], jump: f64) -> Option<Smoothed> {
        let steady = self.steady(intensity)?;
        let len = data.residual.first()?.len();
        if jumps.is_empty() || len * self.n * self.n > tuning().locate.covariances {
            self.smooth_with_steady_gain(&steady, data, len)
        } else {
            let mut may_jump = vec![false; len];
            for k in jumps {
                if let Some(flag) = may_jump.get_mut(*k) {
                    *flag = true;
                }
            }
            self.smooth_with_jumps(&steady, &self.process_noise(intensity), data, &may_jump, jump)
        }
    }

    /// Filter and smoother with the steady gain throughout.
    fn smooth_with_steady_gain(&self, steady: &Steady, data: Data, len: usize) -> Option<Smoothed> {
        let (n, p) = (self.n, self.p);
        let mut pass = FilterPass::new(self, &steady.gains.gain);
        let mut predicted = vec![0.0; len * n];
        let mut errors = vec![0.0; len * p];
        let mut sum = 0.0;
        for k in 0..len {
            let error = &mut errors[k * p..(k + 1) * p];
            predicted[k * n..(k + 1) * n].copy_from_slice(&pass.state);
            pass.innovation(self, data, k, error);
            sum += quadratic(&steady.gains.inverse, error);
            pass.advance(self, data, k, error);
        }
        // Backwards: r = H' S^-1 e + L' r, with L = F (I - K H).
        let l = &self.f * (DMatrix::identity(n, n) - &steady.gains.gain * &self.h);
        let lt: Vec<f64> = l.iter().copied().collect(); // columns of L are the rows of L'
        let hs: Vec<f64> = row_major(&(self.h.transpose() * &steady.gains.inverse));
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
        let mut information = self.h.transpose() * &steady.gains.inverse * &self.h;
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
        let deviation = covariance[(self.unknown, self.unknown)].max(0.0).sqrt() * self.scale[self.unknown];
        let log_likelihood = -0.5 * (sum + len as f64 * (steady.gains.log_det + self.log_likelihood_constant()));
        Some(self.finish(predicted, vec![deviation; len], data, log_likelihood))
    }

    /// Filter and smoother with the covariance carried along from each jump until it has settled again.
    fn smooth_with_jumps(&self, steady: &Steady, q: &DMatrix<f64>, data: Data, jumps: &[bool], jump: f64) -> Option<Smoothed> {
        let Forward { mut states, errors, transients, sum } = self.filter_with_jumps(steady, q, data, jumps, jump)?;
        let deviations = self.backward_with_jumps(steady, &mut states, &errors, &transients);
        let log_likelihood = -0.5 * (sum + jumps.len() as f64 * self.log_likelihood_constant());
        Some(self.finish(states, deviations, data, log_likelihood))
    }

    /// The forward pass; `jumps` marks the samples at which the unknown may jump.
    fn filter_with_jumps(&self, steady: &Steady, q: &DMatrix<f64>, data: Data, jumps: &[bool], jump: f64) -> Option<Forward> {
        let (n, p, len) = (self.n, self.p, jumps.len());
        let extra = (jump / self.scale[self.unknown]).powi(2);
        let mut covariance = steady.predicted.clone();
        let mut settled = true;
        let mut pass = FilterPass::new(self, &steady.gains.gain);
        let mut now = steady.gains.clone();
        let (mut states, mut errors) = (vec![0.0; len * n], vec![0.0; len * p]);
        let mut transients: Vec<Option<Box<Transient>>> = (0..len).map(|_| None).collect();
        let mut sum = 0.0;
        for k in 0..len {
            if jumps[k] {
                covariance[(self.unknown, self.unknown)] += extra;
                settled = false;
            }
            if !settled {
                now = self.gains(&covariance)?;
                pass.set_gain(&now.gain);
                transients[k] = Some(Box::new(Transient { covariance: covariance.clone(), gains: now.clone() }));
            }
            let error = &mut errors[k * p..(k + 1) * p];
            states[k * n..(k + 1) * n].copy_from_slice(&pass.state);
            pass.innovation(self, data, k, error);
            sum += quadratic(&now.inverse, error) + now.log_det;
            pass.advance(self, data, k, error);
            if !settled {
                let kept = DMatrix::identity(n, n) - &now.gain * &self.h;
                let next = &self.f * (&kept * &covariance) * self.f.transpose() + q;
                covariance = (&next + next.transpose()) * 0.5;
                let distance = (&covariance - &steady.predicted).amax();
                if distance <= 1e-3 * steady.predicted.amax() {
                    settled = true;
                    covariance.copy_from(&steady.predicted);
                    now = steady.gains.clone();
                    pass.set_gain(&now.gain);
                }
            }
        }
        Some(Forward { states, errors, transients, sum })
    }

    /// The backward pass: turns predicted states into smoothed ones, and gives the standard deviation of the unknown at each sample.
    fn backward_with_jumps(&self, steady: &Steady, states: &mut [f64], errors: &[f64], transients: &[Option<Box<Transient>>]) -> Vec<f64> {
        let (n, p, len) = (self.n, self.p, transients.len());
        let steady_l = &self.f * (DMatrix::identity(n, n) - &steady.gains.gain * &self.h);
        let steady_h = self.h.transpose() * &steady.gains.inverse;
        let mut r = DVector::zeros(n);
        let mut information = DMatrix::zeros(n, n);
        let mut deviations = vec![0.0; len];
        let (mut steady_since, mut last) = (0, 0.0);
        for k in (0..len).rev() {
            let error = DVector::from_column_slice(&errors[k * p..(k + 1) * p]);
            let mut at = |covariance: &DMatrix<f64>, l: &DMatrix<f64>, hs: &DMatrix<f64>, skip: bool| {
                r = l.transpose() * &r + hs * &error;
                let state = covariance * &r;
                for i in 0..n {
                    states[k * n + i] += state[i];
                }
                if !skip {
                    information = l.transpose() * &information * l + hs * &self.h;
                    let row = covariance.row(self.unknown);
                    let reduced = (row * &information * row.transpose())[(0, 0)];
                    last = (covariance[(self.unknown, self.unknown)] - reduced).max(0.0).sqrt() * self.scale[self.unknown];
                }
                deviations[k] = last;
            };
            match &transients[k] {
                Some(transient) => {
                    let Transient { covariance, gains } = transient.as_ref();
                    let l = &self.f * (DMatrix::identity(n, n) - &gains.gain * &self.h);
                    at(covariance, &l, &(self.h.transpose() * &gains.inverse), false);
                    steady_since = 0;
                }
                None => {
                    at(&steady.predicted, &steady_l, &steady_h, steady_since > tuning().locate.settled);
                    steady_since += 1;
                }
            }
        }
        deviations
    }

    fn finish(&self, mut states: Vec<f64>, deviation: Vec<f64>, data: Data, log_likelihood: f64) -> Smoothed {
        for state in states.chunks_exact_mut(self.n) {
            state.iter_mut().zip(self.scale.iter()).for_each(|(x, s)| *x *= s);
        }
        let value =
            states.chunks_exact(self.n).enumerate().map(|(k, s)| s[self.unknown] + data.known.get(k).copied().unwrap_or(0.0)).collect();
        Smoothed { value, deviation, states, n: self.n, log_likelihood }
    }
}
