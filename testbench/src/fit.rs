//! Least squares on a simulation's error, for a few numbers: Levenberg (1944) and Marquardt (1963) with differences.

use nalgebra::{DMatrix, DVector};

/// Numbers and how well they are known.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// The parameters.
    pub values: Vec<f64>,
    /// Their standard errors from the residuals taken as white.
    pub deviations: Vec<f64>,
    /// Root mean square of the residuals.
    pub rms: f64,
}

/// Numbers above 0 that make the residuals small, from a start above 0; they are moved by their logarithm.
///
/// `None` where the start has no finite residuals, or they do not depend on the parameters.
pub fn positive(start: &[f64], steps: usize, residuals: impl Fn(&[f64]) -> Vec<f64>) -> Option<Fitted> {
    let of = |logs: &DVector<f64>| DVector::from_vec(residuals(logs.map(f64::exp).as_slice()));
    let mut logs = DVector::from_iterator(start.len(), start.iter().map(|v| v.ln()));
    let mut now = of(&logs);
    let mut damping = 1e-3;
    let finite = |r: &DVector<f64>| r.norm_squared().is_finite();
    if !finite(&now) {
        return None;
    }
    let slopes = |logs: &DVector<f64>, now: &DVector<f64>| {
        let mut jacobian = DMatrix::zeros(now.len(), logs.len());
        for j in 0..logs.len() {
            let mut moved = logs.clone();
            moved[j] += 1e-5;
            jacobian.set_column(j, &((of(&moved) - now) / 1e-5));
        }
        jacobian
    };
    let mut jacobian = slopes(&logs, &now);
    for _ in 0..steps {
        let normal = jacobian.tr_mul(&jacobian);
        let slope = jacobian.tr_mul(&now);
        let before = now.norm_squared();
        let mut moved = false;
        for _ in 0..8 {
            let mut damped = normal.clone();
            for i in 0..damped.nrows() {
                damped[(i, i)] *= 1.0 + damping;
            }
            let step = damped.cholesky()?.solve(&slope);
            // Not more than a factor of three at once.
            let trial = &logs - step.map(|s| s.clamp(-1.1, 1.1));
            let then = of(&trial);
            if finite(&then) && then.norm_squared() < before {
                (logs, now, moved, damping) = (trial, then, true, damping / 10.0);
                break;
            }
            damping *= 10.0;
        }
        if !moved {
            break;
        }
        let gained = before - now.norm_squared();
        jacobian = slopes(&logs, &now);
        if gained < 1e-8 * before {
            break;
        }
    }
    let free = (now.len() - logs.len().min(now.len() - 1)) as f64;
    let covariance = jacobian.tr_mul(&jacobian).try_inverse()? * (now.norm_squared() / free);
    let values: Vec<f64> = logs.iter().map(|l| l.exp()).collect();
    let deviations = values.iter().enumerate().map(|(i, v)| v * covariance[(i, i)].sqrt()).collect();
    Some(Fitted { values, deviations, rms: (now.norm_squared() / now.len() as f64).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decay_is_found() {
        let data: Vec<f64> = (0..200).map(|k| 3.0 * (-0.02 * k as f64).exp()).collect();
        let found = positive(&[1.0, 0.2], 50, |v| (0..200).map(|k| v[0] * (-v[1] * k as f64).exp() - data[k]).collect()).unwrap();
        assert!((found.values[0] - 3.0).abs() < 1e-6 && (found.values[1] - 0.02).abs() < 1e-8, "{found:?}");
        assert!(positive(&[1.0], 5, |_| vec![f64::NAN; 3]).is_none());
    }
}
