//! Fits by output error: bounded, damped Gauss-Newton steps on the free runs of all records.

use crate::record::Record;
use crate::simulate::simulate;
use backdrive_plant::servo::{Number, Numbers};
use backdrive_signal::statistics::rms;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Substeps between two samples take at most so long, s.
const SUBSTEP: f64 = 7e-3;
/// Errors beyond this number of scales count by their size, no more by its square: a loss in a few segments does not dominate a fit.
const BOUND: f64 = 2.0;

/// What is fitted.
pub struct Problem<'a> {
    /// The records.
    pub records: Vec<&'a Record>,
    /// The error that counts as 1, of each record, rad.
    pub scales: Vec<f64>,
    /// Which fold each block of a record belongs to; a record is cut into [`BLOCKS`].
    pub folds: Vec<[usize; BLOCKS]>,
    /// How many folds there are.
    pub fold_count: usize,
    substeps: Vec<usize>,
}

/// Largest friction by load that a fit tries.
const MOST_LOAD_FRICTION: f64 = 2.0;

/// Steps of a fit without a fold, after the one by the derivatives of the whole.
const LEFT_OUT: usize = 1;

/// Stretches that a record is cut into, for comparisons.
pub const BLOCKS: usize = 4;

/// Fitted parameters.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Which are free.
    pub free: Vec<Number>,
    /// All numbers.
    pub numbers: Numbers,
    /// Mean loss.
    pub cost: f64,
}

impl<'a> Problem<'a> {
    /// Records are left out whole where there are enough of them, else stretches of them. `scale`: the first of every record, rad.
    pub fn new(records: Vec<&'a Record>, scale: f64) -> Problem<'a> {
        let whole = records.len() >= 4;
        let fold_count = if whole { records.len().min(5) } else { BLOCKS };
        let folds =
            (0..records.len()).map(|r| std::array::from_fn(|b| if whole { r % fold_count } else { (r + b) % fold_count })).collect();
        let substeps = records.iter().map(|r| substeps(r)).collect();
        let scales = vec![scale; records.len()];
        Problem { records, scales, folds, fold_count, substeps }
    }

    /// The scale of each record becomes the root mean square of its own error, at least `least` (rad); returns the mean change of the logarithms, without
    /// sign.
    ///
    /// Large and fast motions leave larger errors than small and slow ones, because every law simplifies. With a common scale they alone decide a fit. For
    /// errors whose deviation is unknown in each record, maximum likelihood minimises the sum of the logarithms of these deviations; this is one step of it.
    pub fn rescale(&mut self, numbers: &Numbers, least: f64) -> f64 {
        let new: Vec<f64> = self.errors(numbers).iter().map(|e| rms(e).max(least)).collect();
        let change = new.iter().zip(&self.scales).map(|(new, old)| (new / old).ln().abs()).sum::<f64>() / new.len().max(1) as f64;
        self.scales = new;
        change
    }

    fn residuals(&self, numbers: &Numbers, without: Option<usize>) -> Vec<Vec<f64>> {
        (0..self.records.len())
            .into_par_iter()
            .map(|index| {
                let record = self.records[index];
                let fold = &self.folds[index];
                if without.is_some_and(|w| fold.iter().all(|f| *f == w)) {
                    return Vec::new();
                }
                let mut r: Vec<f64> = simulate(numbers, record, self.substeps[index]);
                let count = r.len().max(1);
                for (i, (s, p)) in r.iter_mut().zip(&record.position).enumerate() {
                    let out = without.is_some_and(|w| fold[i * BLOCKS / count] == w);
                    *s = if out { 0.0 } else { (*s - p) / self.scales[index] };
                }
                r
            })
            .collect()
    }

    /// Mean loss of each stretch of each record.
    pub fn blocks(&self, numbers: &Numbers) -> Vec<[f64; BLOCKS]> {
        let blocks = |r: &Vec<f64>| {
            std::array::from_fn(|b| {
                let part = block(r, b);
                part.iter().map(|x| loss(*x)).sum::<f64>() / part.len().max(1) as f64
            })
        };
        self.residuals(numbers, None).iter().map(blocks).collect()
    }

    /// Errors of free runs, rad, by record.
    pub fn errors(&self, numbers: &Numbers) -> Vec<Vec<f64>> {
        let scaled = self.residuals(numbers, None).into_iter().zip(&self.scales);
        scaled.map(|(r, scale)| r.into_iter().map(|x| x * scale).collect()).collect()
    }

    /// Fits the free parameters from a start on, in at most this number of steps; `without`: a fold that the fit does not see.
    pub fn fit(&self, free: &[Number], start: &Numbers, most: usize, without: Option<usize>) -> Fit {
        let mut numbers = *start;
        for n in free {
            let [least, largest] = range(*n);
            numbers[*n] = numbers[*n].clamp(least, largest);
        }
        let mut residuals = self.residuals(&numbers, without);
        let mut cost = mean_loss(&residuals);
        let mut damping = 1e-2;
        let mut weak = 0;
        for _ in 0..most {
            let (h, g) = self.normal(free, &numbers, &residuals, without);
            let mut better = None;
            for _ in 0..5 {
                let mut a = h.clone();
                for i in 0..free.len() {
                    a[(i, i)] += damping * h[(i, i)] + 1e-12;
                }
                let step = solve(&a, &g, free, &numbers);
                let Some(step) = step else {
                    damping *= 10.0;
                    continue;
                };
                let trial = stepped(free, &numbers, &step, 1.0);
                let r = self.residuals(&trial, without);
                let c = mean_loss(&r);
                if c.is_finite() && c < cost {
                    better = Some((trial, r, c));
                    damping = (damping * 0.2).max(1e-9);
                    break;
                }
                damping *= 8.0;
            }
            let Some((trial, r, c)) = better else { break };
            let gain = cost - c;
            (numbers, residuals, cost) = (trial, r, c);
            // Stick makes the descent uneven: one weak step is no end yet.
            weak = if gain < 1e-3 * cost { weak + 1 } else { 0 };
            if weak == 2 {
                break;
            }
        }
        Fit { free: free.to_vec(), numbers, cost }
    }

    /// Parameters of fits without each fold: one step from the fit to all with the derivatives there, halved until it is none for the worse.
    pub fn leave_out(&self, fit: &Fit) -> Vec<Numbers> {
        let residuals = self.residuals(&fit.numbers, None);
        let parts = self.parts(&fit.free, &fit.numbers, &residuals, None);
        let of_fold = |k: usize| {
            let n = fit.free.len();
            let (mut h, mut g) = (DMatrix::zeros(n, n), DVector::zeros(n));
            let mut before = 0.0;
            for (r, blocks) in parts.iter().enumerate() {
                for (b, (bh, bg)) in blocks.iter().enumerate().filter(|(b, _)| self.folds[r][*b] != k) {
                    h += bh;
                    g += bg;
                    before += block(&residuals[r], b).iter().map(|x| loss(*x)).sum::<f64>();
                }
            }
            for i in 0..n {
                h[(i, i)] += 1e-4 * h[(i, i)] + 1e-12;
            }
            let Some(step) = solve(&h, &g, &fit.free, &fit.numbers) else { return fit.numbers };
            let mut share = 1.0;
            for _ in 0..3 {
                let trial = stepped(&fit.free, &fit.numbers, &step, share);
                let after: f64 = self.residuals(&trial, Some(k)).iter().flatten().map(|x| loss(*x)).sum();
                if after < before {
                    return self.fit(&fit.free, &trial, LEFT_OUT, Some(k)).numbers;
                }
                share *= 0.4;
            }
            self.fit(&fit.free, &fit.numbers, LEFT_OUT, Some(k)).numbers
        };
        (0..self.fold_count).into_par_iter().map(of_fold).collect()
    }

    fn normal(&self, free: &[Number], numbers: &Numbers, residuals: &[Vec<f64>], without: Option<usize>) -> (DMatrix<f64>, DVector<f64>) {
        let n = free.len();
        let parts = self.parts(free, numbers, residuals, without);
        parts.into_iter().flatten().fold((DMatrix::zeros(n, n), DVector::zeros(n)), |(h, g), (bh, bg)| (h + bh, g + bg))
    }

    /// `J' W J` and `J' W r` of every stretch of every record.
    fn parts(
        &self,
        free: &[Number],
        numbers: &Numbers,
        residuals: &[Vec<f64>],
        without: Option<usize>,
    ) -> Vec<Vec<(DMatrix<f64>, DVector<f64>)>> {
        let columns: Vec<Vec<Vec<f64>>> = free
            .par_iter()
            .map(|n| {
                let d = 0.02 * size(*n, numbers);
                let d = if numbers[*n] + d > range(*n)[1] { -d } else { d };
                let mut there = *numbers;
                there[*n] += d;
                let unit = size(*n, numbers) / d;
                let moved = self.residuals(&there, without);
                moved.iter().zip(residuals).map(|(m, r)| m.iter().zip(r).map(|(m, r)| (m - r) * unit).collect()).collect()
            })
            .collect();
        let k = free.len();
        let of_block = |index: usize, b: usize| {
            let r = block(&residuals[index], b);
            let weights: Vec<f64> = r.iter().map(|x| slope(*x)).collect();
            let (mut h, mut g) = (DMatrix::zeros(k, k), DVector::zeros(k));
            for i in 0..k {
                let a: Vec<f64> = block(&columns[i][index], b).iter().zip(&weights).map(|(a, w)| a * w).collect();
                g[i] = dot(&a, r);
                for j in 0..=i {
                    h[(i, j)] = dot(&a, block(&columns[j][index], b));
                    h[(j, i)] = h[(i, j)];
                }
            }
            (h, g)
        };
        (0..residuals.len()).into_par_iter().map(|index| (0..BLOCKS).map(|b| of_block(index, b)).collect()).collect()
    }
}

/// A stretch of a record's values; of a record that is left out none.
fn block(values: &[f64], b: usize) -> &[f64] {
    let count = values.len();
    values.get(b * count / BLOCKS..(b + 1) * count / BLOCKS).unwrap_or_default()
}

/// Numbers after a share of a step.
fn stepped(free: &[Number], numbers: &Numbers, step: &DVector<f64>, share: f64) -> Numbers {
    let mut trial = *numbers;
    for (n, s) in free.iter().zip(step.iter()) {
        let [least, largest] = range(*n);
        trial[*n] = (trial[*n] - share * s * size(*n, numbers)).clamp(least, largest);
    }
    trial
}

/// Substeps for a record.
pub fn substeps(record: &Record) -> usize {
    let count = record.t.len();
    let span = record.t.last().zip(record.t.first()).map_or(0.0, |(last, first)| last - first);
    ((span / (count.max(2) - 1) as f64 / SUBSTEP).ceil() as usize).clamp(1, 50)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn mean_loss(residuals: &[Vec<f64>]) -> f64 {
    let count = residuals.iter().map(Vec::len).sum::<usize>().max(1);
    residuals.iter().flatten().map(|x| loss(*x)).sum::<f64>() / count as f64
}

/// A step in which no number leaves its range; those that would are held.
fn solve(a: &DMatrix<f64>, g: &DVector<f64>, free: &[Number], numbers: &Numbers) -> Option<DVector<f64>> {
    let mut kept: Vec<usize> = (0..free.len()).collect();
    loop {
        if kept.is_empty() {
            return None;
        }
        let part = DMatrix::from_fn(kept.len(), kept.len(), |i, j| a[(kept[i], kept[j])]);
        let right = DVector::from_fn(kept.len(), |i, _| g[kept[i]]);
        let step = part.cholesky()?.solve(&right);
        let leaves = |k: usize| {
            let [least, largest] = range(free[kept[k]]);
            let now = numbers[free[kept[k]]];
            (now <= least && step[k] > 0.0) || (now >= largest && step[k] < 0.0)
        };
        match (0..kept.len()).find(|k| leaves(*k)) {
            Some(k) => {
                kept.remove(k);
            }
            None => {
                let mut out = DVector::zeros(free.len());
                kept.iter().zip(step.iter()).for_each(|(i, x)| out[*i] = *x);
                return Some(out);
            }
        }
    }
}

/// Limits of a number in a fit: those of a model file, and of friction by load what gears have; a gear that blocks itself has a little more than 1.
fn range(n: Number) -> [f64; 2] {
    match n {
        Number::LoadFriction => [0.0, MOST_LOAD_FRICTION],
        _ => n.facts().range,
    }
}

/// The unit in which a number is stepped.
fn size(n: Number, numbers: &Numbers) -> f64 {
    let f = n.facts();
    match f.nothing > 1e8 {
        true => 0.1 * numbers[n].abs().max(0.1 * f.scale),
        false => f.scale.max(0.1 * numbers[n].abs()),
    }
}

fn loss(x: f64) -> f64 {
    let a = x.abs();
    if a <= BOUND { a * a } else { BOUND * (2.0 * a - BOUND) }
}

fn slope(x: f64) -> f64 {
    let a = x.abs();
    if a <= BOUND { 1.0 } else { BOUND / a }
}
