//! How sure the parameters of a fit are.

use crate::output_error::candidate::Candidate;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::normal_equations::normal_equations;
use crate::output_error::simulate::TWICE;
use crate::output_error::structure::{Bound, FreeParameter, Role, Structure};
use crate::output_error::work::{Budget, Limit, Steps};
use crate::tuning::tuning;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Standard deviations of a fit's parameters, in the fit's own unit (logarithms where it steps in them), and their correlations. Residuals
/// that are correlated count as fewer, and whatever is unexplained counts as error.
#[derive(Debug, Clone)]
pub struct Uncertainty {
    /// One for each parameter; infinite where the recordings do not determine it.
    pub deviation: Vec<f64>,
    /// How far each parameter may be off in addition, whatever the noise: what the fit's last step and finer simulation steps would move it.
    pub bias: Vec<f64>,
    /// Correlation of each with each.
    pub correlation: DMatrix<f64>,
}

/// Half of a 95 % interval in standard deviations of a normal distribution.
pub(crate) const NORMAL_975: f64 = 1.959_964;

impl Uncertainty {
    /// From the curvature where the fit ended.
    pub fn of(candidate: &Candidate) -> Uncertainty {
        let fit = &candidate.fit;
        let n = fit.values.len();
        let matrix = curvature(candidate, &fit.jacobian, &fit.residuals);
        let unit = unit(candidate, &fit.residuals);
        let mut deviation = vec![f64::INFINITY; n];
        let mut correlation = DMatrix::identity(n, n);
        if let Some(inverse) = inverse(&matrix) {
            for j in (0..n).filter(|j| matrix[(*j, *j)] > 0.0) {
                deviation[j] = (inverse[(j, j)] * unit).sqrt();
                for k in 0..n {
                    let size = (inverse[(j, j)] * inverse[(k, k)]).sqrt();
                    correlation[(j, k)] =
                        if j == k || !(size > 0.0 && size.is_finite()) { f64::from(u8::from(j == k)) } else { inverse[(j, k)] / size };
                }
            }
        }
        Uncertainty { deviation, bias: vec![0.0; n], correlation }
    }

    /// The same, measured where the fit ended, from three sources. Derivatives are taken from both sides. The scatter of the scores is taken over blocks of
    /// the recordings, because residuals are correlated and their variance differs from place to place: Huber's sandwich estimate by blocks. The third is
    /// the change caused by finer steps of the simulation.
    pub fn measured(evaluator: &Evaluator, candidate: &Candidate) -> Uncertainty {
        let mut spread = Uncertainty::of(candidate);
        let structure = &candidate.structure;
        let own: Vec<f64> = structure.free.iter().zip(&candidate.fit.values).map(|(n, v)| n.to_internal(*v)).collect();
        let counted = evaluator.within(Budget::new(Steps::MAX, Limit::default()));
        let Some(residuals) = counted.residuals(structure, &candidate.fit.values) else { return spread };
        // Where simulations are slow, derivatives come from fewer substeps, and finer ones are not tried.
        let slow = counted.budget.spent() > tuning().intervals.slow;
        let coarser = Evaluator { substeps: if slow { tuning().intervals.slow_substeps } else { evaluator.substeps }, ..evaluator.clone() };
        let Some(there) = (if slow { coarser.residuals(structure, &candidate.fit.values) } else { Some(residuals.clone()) }) else {
            return spread;
        };
        let all: Vec<usize> = (0..own.len()).collect();
        let (ahead, behind) = (coarser.columns(structure, &own, &there, &all, 1.0), coarser.columns(structure, &own, &there, &all, -1.0));
        let jacobian: Vec<Vec<f64>> =
            ahead.iter().zip(&behind).map(|(a, b)| a.iter().zip(b).map(|(x, y)| 0.5 * (x + y)).collect()).collect();
        let matrix = curvature(candidate, &jacobian, &residuals);
        let Some(inverse) = inverse(&matrix) else { return spread };
        let n = own.len();
        let unit = unit(candidate, &residuals);
        // Scores by blocks.
        let mut scatter = DMatrix::<f64>::zeros(n, n);
        let mut blocks = 0.0f64;
        for (_, _, range) in evaluator.layout() {
            let length = (range.len() / tuning().intervals.blocks)
                .max((tuning().intervals.block_correlations * candidate.correlation_time) as usize)
                .clamp(1, range.len().max(1));
            for from in range.clone().step_by(length) {
                let to = (from + length).min(range.end);
                let score =
                    DVector::from_iterator(n, jacobian.iter().map(|c| crate::output_error::fit::dot(&c[from..to], &residuals[from..to])));
                scatter += &score * score.transpose();
                blocks += 1.0;
            }
        }
        let correction = if blocks > n as f64 + 1.0 { blocks / (blocks - n as f64) } else { 2.0 };
        let sandwich = &inverse * scatter * &inverse * correction;
        let step = |residuals: &[f64]| {
            let slope = DVector::from_iterator(n, jacobian.iter().map(|c| crate::output_error::fit::dot(c, residuals)));
            &inverse * slope
        };
        let last = step(&residuals);
        let fine = Evaluator { substeps: TWICE, ..evaluator.clone() };
        let finer = if slow { None } else { fine.residuals(structure, &candidate.fit.values) };
        let numerical = finer.map(|f| step(&f.iter().zip(&residuals).map(|(a, b)| a - b).collect::<Vec<f64>>()));
        for j in 0..n {
            let variance = (inverse[(j, j)] * unit).max(sandwich[(j, j)]);
            if variance.is_finite() && variance > 0.0 {
                spread.deviation[j] = variance.sqrt();
            }
            let prior = structure.free[j].prior.is_none() || spread.deviation[j] < 1.0;
            let moved = if prior { last[j].abs().min(tuning().intervals.last_step * spread.deviation[j]) } else { 0.0 };
            spread.bias[j] = moved + numerical.as_ref().map_or(0.0, |d| d[j].abs());
        }
        spread
    }

    /// Whether some of these parameters differ from their fitted values by more than chance. `others` are places among the fit's parameters, and their
    /// values in the units of the model. All are tested jointly, because each of several correlated parameters may lie in its own interval.
    pub fn is_far(&self, candidate: &Candidate, others: &[(usize, f64)]) -> bool {
        let away = |(number, other): &(usize, f64)| {
            let (n, value) = (candidate.structure.free.get(*number)?, candidate.fit.values.get(*number)?);
            let (deviation, bias) = (self.deviation.get(*number)?, self.bias.get(*number)?);
            let off = n.to_internal(*other) - n.to_internal(*value);
            let beyond = (off.abs() - bias).max(0.0).copysign(off);
            deviation.is_finite().then_some((*number, beyond / deviation))
        };
        let known: Vec<(usize, f64)> = others.iter().filter_map(away).collect();
        let correlation = DMatrix::from_fn(known.len(), known.len(), |a, b| self.correlation[(known[a].0, known[b].0)]);
        let square = distance_square(&known.iter().map(|k| k.1).collect::<Vec<f64>>(), correlation);
        ChiSquared::new(known.len() as f64).is_ok_and(|d| d.sf(square) < tuning().claim.significance)
    }

    /// Half of a parameter's 95 % interval, in the fit's own unit.
    pub fn half(&self, number: usize) -> f64 {
        let deviation = self.deviation.get(number).copied().unwrap_or(f64::INFINITY);
        tuning().intervals.wider * NORMAL_975 * deviation + self.bias.get(number).copied().unwrap_or(0.0)
    }

    /// 95 % interval of a parameter, in the unit of the model.
    pub fn interval(&self, candidate: &Candidate, number: usize) -> [f64; 2] {
        let (Some(n), Some(value)) = (candidate.structure.free.get(number), candidate.fit.values.get(number)) else {
            return [f64::NAN; 2];
        };
        let (low, high) = n.bounds();
        let own = n.to_internal(*value);
        let half = self.half(number);
        [n.to_external((own - half).max(low)), n.to_external((own + half).min(high))]
    }

    /// The same, one-sided where the parameter is at a bound: the recordings then show only that it is no less far than that. `None` for an open end.
    pub fn one_sided(&self, candidate: &Candidate, number: usize) -> [Option<f64>; 2] {
        let [low, high] = self.interval(candidate, number).map(|end| Some(end).filter(|x| x.is_finite()));
        let bound = candidate.structure.free.get(number).zip(candidate.fit.values.get(number)).and_then(|(n, value)| n.at_bound(*value));
        match bound {
            Some(Bound::Low) => [None, high],
            Some(Bound::High) => [low, None],
            None => [low, high],
        }
    }

    /// Adds the spread of the same parameters over other explanations of nearly the same fit, each with a weight of 0 to 1: parameters are as uncertain as
    /// the structure around them.
    pub fn beside(&mut self, candidate: &Candidate, others: &[(&Candidate, f64)]) {
        let structure = &candidate.structure;
        let sum = 1.0 + others.iter().map(|(_, weight)| weight).sum::<f64>();
        for (j, number) in structure.free.iter().enumerate() {
            let own = number.to_internal(candidate.fit.values[j]);
            let square = |(other, weight): &(&Candidate, f64)| {
                let place = other.structure.free.iter().position(|n| is_same(structure, number, &other.structure, n))?;
                Some(weight * (number.to_internal(*other.fit.values.get(place)?) - own).powi(2))
            };
            let variance = others.iter().filter_map(square).sum::<f64>() / sum;
            if self.deviation[j].is_finite() {
                self.deviation[j] = self.deviation[j].hypot(variance.sqrt());
            }
        }
    }
}

/// Whether parameters of two structures are the same one.
fn is_same(a: &Structure, number: &FreeParameter, b: &Structure, other: &FreeParameter) -> bool {
    match (&number.role, &other.role) {
        (Role::Added(h, p), Role::Added(k, q)) => {
            p == q && a.added.get(*h).zip(b.added.get(*k)).is_some_and(|(own, other)| own.id == other.id)
        }
        (own, other) => own == other,
    }
}

/// Square of the distance of normal variables from their means: `off` in standard deviations.
fn distance_square(off: &[f64], correlation: DMatrix<f64>) -> f64 {
    let off = DVector::from_column_slice(off);
    // What does not tell two parameters apart at all must not make them far.
    let inner = (correlation + DMatrix::identity(off.len(), off.len()) * 1e-6).cholesky();
    inner.map_or_else(|| off.norm_squared(), |inner| off.dot(&inner.solve(&off)))
}

/// Curvature of half the cost, priors included.
fn curvature(candidate: &Candidate, jacobian: &[Vec<f64>], residuals: &[f64]) -> DMatrix<f64> {
    let (mut matrix, _) = normal_equations(jacobian, residuals, None);
    for (j, number) in candidate.structure.free.iter().enumerate() {
        if let Some((_, spread)) = number.prior {
            matrix[(j, j)] += 1.0 / (spread * spread);
        }
    }
    matrix
}

/// Variance of one independent residual, times how many residuals are worth one.
fn unit(candidate: &Candidate, residuals: &[f64]) -> f64 {
    (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len().max(1) as f64).max(1.0) * candidate.correlation_time
}

/// Inverse by scaled Cholesky factors; rows without curvature stay 0.
fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    let scale: Vec<f64> = (0..n).map(|j| matrix[(j, j)].sqrt()).collect();
    let live: Vec<usize> = (0..n).filter(|j| scale[*j] > 0.0).collect();
    let scaled = DMatrix::from_fn(live.len(), live.len(), |a, b| {
        matrix[(live[a], live[b])] / (scale[live[a]] * scale[live[b]]) + if a == b { 1e-12 } else { 0.0 }
    });
    let inner = scaled.cholesky()?.inverse();
    let mut inverse = DMatrix::zeros(n, n);
    for (a, j) in live.iter().enumerate() {
        for (b, k) in live.iter().enumerate() {
            inverse[(*j, *k)] = inner[(a, b)] / (scale[*j] * scale[*k]);
        }
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_go_together_are_nearer_than_each_says() {
        let of = |off: [f64; 2], rho: f64| distance_square(&off, DMatrix::from_row_slice(2, 2, &[1.0, rho, rho, 1.0]));
        // 2/(1 + rho) along the direction in which they vary jointly, 2/(1 - rho) across it.
        for rho in [0.0, 0.5, 0.9] {
            assert!((of([1.0, 1.0], rho) / (2.0 / (1.0 + rho)) - 1.0).abs() < 1e-4);
            assert!((of([1.0, -1.0], rho) / (2.0 / (1.0 - rho)) - 1.0).abs() < 1e-4);
        }
        assert!(of([1.0, 1.0], 1.0) < 1.001);
    }
}
