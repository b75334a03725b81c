//! How sure the numbers of a fit are.

use crate::fit::normal_equations;
use crate::search::Candidate;
use nalgebra::DMatrix;

/// Standard deviations of a fit's numbers, in the fit's own unit (logarithms where it steps in them), and their correlations. Residuals
/// that hang together count as fewer, and what is left over counts as error.
#[derive(Debug, Clone)]
pub struct Spread {
    /// One for each number; infinite where the recordings do not determine it.
    pub deviation: Vec<f64>,
    /// Correlation of each with each.
    pub correlation: DMatrix<f64>,
}

/// 97.5 % of a normal distribution.
const NORMAL_975: f64 = 1.959_964;

impl Spread {
    /// From the curvature where the fit ended.
    pub fn of(candidate: &Candidate) -> Spread {
        let fit = &candidate.fit;
        let n = fit.values.len();
        let (mut matrix, _) = normal_equations(&fit.jacobian, &fit.residuals, None);
        for (j, number) in candidate.structure.numbers.iter().enumerate() {
            if let Some((_, spread)) = number.prior {
                matrix[(j, j)] += 1.0 / (spread * spread);
            }
        }
        let scale: Vec<f64> = (0..n).map(|j| matrix[(j, j)].sqrt()).collect();
        let live: Vec<usize> = (0..n).filter(|j| scale[*j] > 0.0).collect();
        let scaled = DMatrix::from_fn(live.len(), live.len(), |a, b| {
            matrix[(live[a], live[b])] / (scale[live[a]] * scale[live[b]]) + if a == b { 1e-12 } else { 0.0 }
        });
        let mut deviation = vec![f64::INFINITY; n];
        let mut correlation = DMatrix::identity(n, n);
        let unit =
            (fit.residuals.iter().map(|r| r * r).sum::<f64>() / fit.residuals.len().max(1) as f64).max(1.0) * candidate.correlation_time;
        if let Some(inverse) = scaled.cholesky().map(|c| c.inverse()) {
            for (a, j) in live.iter().enumerate() {
                deviation[*j] = (inverse[(a, a)] * unit).sqrt() / scale[*j];
                for (b, k) in live.iter().enumerate() {
                    correlation[(*j, *k)] = inverse[(a, b)] / (inverse[(a, a)] * inverse[(b, b)]).sqrt();
                }
            }
        }
        Spread { deviation, correlation }
    }

    /// 95 % interval of a number, as it stands in the model.
    pub fn interval(&self, candidate: &Candidate, number: usize) -> [f64; 2] {
        let (Some(n), Some(value)) = (candidate.structure.numbers.get(number), candidate.fit.values.get(number)) else {
            return [f64::NAN; 2];
        };
        let (low, high) = n.bounds();
        let own = n.inward(*value);
        let half = NORMAL_975 * self.deviation.get(number).copied().unwrap_or(f64::INFINITY);
        [n.outward((own - half).max(low)), n.outward((own + half).min(high))]
    }
}
