//! Fits by simulation error: bounded Levenberg-Marquardt steps with differences in parallel.

use crate::problem::{Problem, Record};
use crate::structure::{Number, Structure};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// What a fit is held against: recordings, the size of each output's measuring error, and how large errors count.
#[derive(Clone)]
pub struct Evaluator<'a> {
    /// The problem they belong to.
    pub problem: &'a Problem,
    /// The recordings.
    pub records: &'a [Record],
    /// Standard deviation of the measuring error of each output, in its unit.
    pub floor: Vec<f64>,
    /// Residuals beyond this many floors count by their size, not their square; infinite for none.
    pub robust: f64,
    /// Set from outside to end every fit after its present step.
    pub stop: Option<&'a AtomicBool>,
    /// Simulations of a record so far.
    pub simulations: Arc<AtomicUsize>,
    /// Substeps per sample, at most: fewer are faster, and blur what is very stiff.
    pub substeps: usize,
}

/// How long to try.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Steps at most.
    pub steps: usize,
    /// A fit ends when its next step foresees less than this many units of the mean squared residual.
    pub tolerance: f64,
}

impl Effort {
    /// Until nothing that could matter is foreseen.
    pub const FULL: Effort = Effort { steps: 40, tolerance: 0.3 };
}

/// A fitted structure.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Values of [`Structure::numbers`], as they stand in the model.
    pub values: Vec<f64>,
    /// Sum over the residuals of their squares (or sizes, where robust), with what priors add.
    pub cost: f64,
    /// Measured less predicted over the floor: record by record, output by output.
    pub residuals: Vec<f64>,
    /// Derivatives of the residuals by each number in the fit's own unit, where the last step began.
    pub jacobian: Vec<Vec<f64>>,
    /// What the next step would take from the cost, were the model linear.
    pub foreseen: f64,
    /// Steps taken.
    pub steps: usize,
}

impl<'a> Evaluator<'a> {
    /// Holds fits against a problem's recordings for fitting.
    pub fn new(problem: &'a Problem) -> Evaluator<'a> {
        Evaluator::on(problem, &problem.fit)
    }

    /// Holds fits against other recordings of the same problem.
    pub fn on(problem: &'a Problem, records: &'a [Record]) -> Evaluator<'a> {
        Evaluator { problem, records, floor: problem.floor.clone(), robust: f64::INFINITY, stop: None, simulations: Arc::default(), substeps: 64 }
    }

    /// Number of residuals.
    pub fn len(&self) -> usize {
        self.records.iter().map(residuals_in).sum()
    }

    /// Whether nothing was measured.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where the residuals of a record stand: per measured output, the output's index and its range.
    pub fn layout(&self) -> Vec<(usize, usize, std::ops::Range<usize>)> {
        let mut all = Vec::new();
        let mut at = 0;
        for (r, record) in self.records.iter().enumerate() {
            for output in measured(record) {
                all.push((r, output, at..at + record.len));
                at += record.len;
            }
        }
        all
    }

    /// Residuals of a structure, `None` where it cannot be simulated.
    pub fn residuals(&self, structure: &Structure, values: &[f64]) -> Option<Vec<f64>> {
        let model = structure.model(self.problem, values)?;
        let parts: Option<Vec<Vec<f64>>> =
            (0..self.records.len()).into_par_iter().map(|r| self.record_residuals(structure, &model, values, r)).collect();
        Some(parts?.concat())
    }

    /// Residuals of one record.
    fn record_residuals(&self, structure: &Structure, model: &backdrive_plant::model::Model, values: &[f64], r: usize) -> Option<Vec<f64>> {
        let record = self.records.get(r)?;
        self.simulations.fetch_add(1, Ordering::Relaxed);
        let mut columns = structure.predict(model, values, record, r, self.substeps)?;
        for (column, output) in columns.chunks_exact_mut(record.len).zip(measured(record)) {
            let samples = record.outputs.get(output)?.as_deref()?;
            let (floor, lag) = (self.floor.get(output).copied()?, self.problem.lag.get(output).copied().unwrap_or(0));
            for (prediction, sample) in column.iter_mut().zip(samples) {
                *prediction = (sample - *prediction) / floor;
            }
            if lag > 0 {
                // From the end, so that what is taken off is still the position's.
                for i in (lag..column.len()).rev() {
                    column[i] = (column[i] - column[i - lag]) * std::f64::consts::FRAC_1_SQRT_2;
                }
            }
        }
        Some(columns)
    }

    /// What residuals cost, priors apart.
    pub fn cost(&self, residuals: &[f64]) -> f64 {
        if self.robust.is_infinite() {
            return residuals.iter().map(|r| r * r).sum();
        }
        let k = self.robust;
        residuals.iter().map(|r| if r.abs() <= k { r * r } else { k * (2.0 * r.abs() - k) }).sum()
    }

    /// Derivatives of the residuals by each number in the fit's own unit.
    pub fn jacobian(&self, structure: &Structure, own: &[f64], residuals: &[f64]) -> Vec<Vec<f64>> {
        let spans: Vec<std::ops::Range<usize>> = self
            .records
            .iter()
            .scan(0, |at, record| {
                let from = *at;
                *at += residuals_in(record);
                Some(from..*at)
            })
            .collect();
        let jobs: Vec<(usize, usize)> = structure
            .numbers
            .iter()
            .enumerate()
            .flat_map(|(j, n)| match n.record {
                Some(r) => vec![(j, r)],
                None => (0..self.records.len()).map(|r| (j, r)).collect(),
            })
            .collect();
        let moved: Vec<Option<(Vec<f64>, backdrive_plant::model::Model, f64)>> = structure
            .numbers
            .iter()
            .enumerate()
            .map(|(j, number)| {
                let (values, step) = moved_values(structure, own, j, number);
                Some((values.clone(), structure.model(self.problem, &values)?, step))
            })
            .collect();
        let parts: Vec<Option<Vec<f64>>> = jobs
            .par_iter()
            .map(|(j, r)| {
                let (values, model, step) = moved.get(*j)?.as_ref()?;
                let mut part = self.record_residuals(structure, model, values, *r)?;
                let before = residuals.get(spans[*r].clone())?;
                part.iter_mut().zip(before).for_each(|(a, b)| *a = (*a - b) / step);
                Some(part)
            })
            .collect();
        let mut jacobian = vec![vec![0.0; residuals.len()]; structure.numbers.len()];
        for ((j, r), part) in jobs.iter().zip(parts) {
            if let Some(part) = part {
                jacobian[*j][spans[*r].clone()].copy_from_slice(&part);
            }
        }
        jacobian
    }

    /// Fits a structure from `start` on; `None` where it cannot be simulated there.
    pub fn fit(&self, structure: &Structure, start: &[f64], effort: Effort) -> Option<Fit> {
        let mut own: Vec<f64> = structure.numbers.iter().zip(start).map(|(n, v)| n.inward(*v)).collect();
        let outward = |own: &[f64]| structure.numbers.iter().zip(own).map(|(n, x)| n.outward(*x)).collect::<Vec<f64>>();
        let prior = |own: &[f64]| -> f64 {
            let one = |(n, x): (&Number, &f64)| n.prior.map_or(0.0, |(centre, spread)| ((x - centre) / spread).powi(2));
            structure.numbers.iter().zip(own).map(one).sum()
        };
        let mut residuals = self.residuals(structure, &outward(&own))?;
        let mut cost = self.cost(&residuals) + prior(&own);
        let mut lambda = 1e-3;
        let mut jacobian;
        let mut foreseen;
        let mut steps = 0;
        loop {
            jacobian = self.jacobian(structure, &own, &residuals);
            let weights = self.weights(&residuals);
            let (mut matrix, mut slope) = normal_equations(&jacobian, &residuals, weights.as_deref());
            for (j, number) in structure.numbers.iter().enumerate() {
                if let Some((centre, spread)) = number.prior {
                    matrix[(j, j)] += 1.0 / (spread * spread);
                    slope[j] += (own[j] - centre) / (spread * spread);
                }
            }
            let free: Vec<usize> = (0..own.len()).filter(|j| may_move(&structure.numbers[*j], own[*j], slope[*j], matrix[(*j, *j)])).collect();
            foreseen = step_of(&matrix, &slope, &free, 1e-9).map_or(0.0, |step| free.iter().zip(&step).map(|(j, s)| -slope[*j] * s).sum());
            let unit = cost / residuals.len().max(1) as f64;
            let stopped = self.stop.is_some_and(|s| s.load(Ordering::Relaxed));
            if steps >= effort.steps || foreseen < effort.tolerance * unit || stopped {
                break;
            }
            let mut accepted = false;
            for _ in 0..7 {
                let Some(step) = step_of(&matrix, &slope, &free, lambda) else { break };
                let mut next = own.clone();
                for (j, s) in free.iter().zip(&step) {
                    let number = &structure.numbers[*j];
                    let (low, high) = number.bounds();
                    let longest = if number.log { 1.5 } else { 0.5 * (high - low) };
                    next[*j] = (own[*j] + s.clamp(-longest, longest)).clamp(low, high);
                }
                let tried = self.residuals(structure, &outward(&next)).map(|r| (self.cost(&r) + prior(&next), r));
                match tried {
                    Some((c, r)) if c < cost => {
                        let gained = cost - c;
                        let hoped: f64 = foreseen.max(1e-300);
                        lambda = if gained > 0.5 * hoped { lambda * 0.1 } else { lambda * 0.4 }.max(1e-9);
                        (own, residuals, cost) = (next, r, c);
                        accepted = true;
                        break;
                    }
                    _ => lambda = (lambda * 8.0).min(1e9),
                }
            }
            steps += 1;
            if !accepted {
                break;
            }
        }
        Some(Fit { values: outward(&own), cost, residuals, jacobian, foreseen, steps })
    }

    /// The best of fits from several starts.
    pub fn best_of(&self, structure: &Structure, starts: &[Vec<f64>], effort: Effort) -> Option<Fit> {
        starts.iter().filter_map(|start| self.fit(structure, start, effort)).min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Weights of the residuals where large ones count less.
    pub fn weights(&self, residuals: &[f64]) -> Option<Vec<f64>> {
        self.robust.is_finite().then(|| residuals.iter().map(|r| (self.robust / r.abs().max(1e-300)).min(1.0)).collect())
    }
}

/// Outputs that a record has.
pub fn measured(record: &Record) -> impl Iterator<Item = usize> + '_ {
    record.outputs.iter().enumerate().filter(|(_, samples)| samples.is_some()).map(|(output, _)| output)
}

fn residuals_in(record: &Record) -> usize {
    measured(record).count() * record.len
}

/// Values with one number moved by its step, away from a bound, and the step taken in the fit's own unit.
fn moved_values(structure: &Structure, own: &[f64], j: usize, number: &Number) -> (Vec<f64>, f64) {
    let (low, high) = number.bounds();
    let mut step = number.step.min(0.5 * (high - low));
    if own[j] + step > high {
        step = -step;
    }
    let moved = (own[j] + step).clamp(low, high);
    let values = structure.numbers.iter().enumerate().map(|(i, n)| n.outward(if i == j { moved } else { own[i] })).collect();
    let taken = moved - own[j];
    (values, if taken == 0.0 { 1.0 } else { taken })
}

/// Whether a number has an effect and is not pushed against its bound.
fn may_move(number: &Number, own: f64, slope: f64, curvature: f64) -> bool {
    let (low, high) = number.bounds();
    let edge = 1e-9 * (high - low);
    curvature > 0.0 && !(own <= low + edge && slope > 0.0) && !(own >= high - edge && slope < 0.0)
}

/// `J' W J` and `J' W r`.
pub fn normal_equations(jacobian: &[Vec<f64>], residuals: &[f64], weights: Option<&[f64]>) -> (DMatrix<f64>, DVector<f64>) {
    let n = jacobian.len();
    let dot = |a: &[f64], b: &[f64]| match weights {
        None => dot(a, b),
        Some(w) => a.iter().zip(b).zip(w).map(|((a, b), w)| w * a * b).sum(),
    };
    let rows: Vec<Vec<f64>> = (0..n).into_par_iter().map(|i| (0..=i).map(|j| dot(&jacobian[i], &jacobian[j])).collect()).collect();
    let matrix = DMatrix::from_fn(n, n, |i, j| if j <= i { rows[i][j] } else { rows[j][i] });
    let slope = DVector::from_iterator(n, jacobian.iter().map(|column| dot(column, residuals)));
    (matrix, slope)
}

/// Sum of products, in four chains so that it is not the latency of one that counts.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    sums.iter().sum::<f64>() + tail
}

/// Damped step of the free numbers, scaled by their own curvature.
fn step_of(matrix: &DMatrix<f64>, slope: &DVector<f64>, free: &[usize], lambda: f64) -> Option<Vec<f64>> {
    let scale: Vec<f64> = free.iter().map(|j| matrix[(*j, *j)].sqrt()).collect();
    let scaled = DMatrix::from_fn(free.len(), free.len(), |a, b| {
        matrix[(free[a], free[b])] / (scale[a] * scale[b]) + if a == b { lambda.max(1e-11) } else { 0.0 }
    });
    let right = DVector::from_iterator(free.len(), free.iter().zip(&scale).map(|(j, s)| -slope[*j] / s));
    let solution = scaled.cholesky()?.solve(&right);
    Some(solution.iter().zip(&scale).map(|(x, s)| x / s).collect())
}
