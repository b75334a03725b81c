//! Fits by simulation error: bounded Levenberg-Marquardt steps with differences in parallel.

use crate::effort::Effort;
use crate::guide::Guide;
use crate::normal_equations::normal_equations;
use crate::problem::{Problem, Record};
use crate::structure::{Along, Number, Role, Structure};
use crate::tuning::tuning;
use crate::work::{Budget, Steps};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::collections::BTreeMap;

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
    /// Counts what is computed; every fit ends after its present step once it is used up.
    pub budget: Budget<'a>,
    /// Substeps per sample, at most: fewer are faster, and blur what is very stiff.
    pub substeps: usize,
    /// What leads the simulations along the recordings; `None` for simulation errors.
    pub guide: Option<Guide>,
    /// How wide differences are at first, in steps of each number.
    pub stretch: f64,
    /// How wide they may become where narrow ones mislead.
    pub widest: f64,
    /// Whether only numbers of single records move, such as the curve of a hand that nobody measured.
    pub own_only: bool,
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
        Evaluator {
            problem,
            records,
            floor: problem.floor.clone(),
            robust: f64::INFINITY,
            budget: Budget::default(),
            substeps: tuning().fit.fine_substeps,
            guide: None,
            stretch: 1.0,
            own_only: false,
            widest: tuning().fit.widest,
        }
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
        // All of them even where one fails, so that what is counted does not depend on which thread is first.
        let parts: Vec<Option<Vec<f64>>> =
            (0..self.records.len()).into_par_iter().map(|r| self.record_residuals(structure, &model, values, r)).collect();
        Some(parts.into_iter().collect::<Option<Vec<Vec<f64>>>>()?.concat())
    }

    /// Residuals of one record.
    pub fn record_residuals(
        &self,
        structure: &Structure,
        model: &backdrive_plant::model::Model,
        values: &[f64],
        r: usize,
    ) -> Option<Vec<f64>> {
        let record = self.records.get(r)?;
        let along = Along { substeps: self.substeps, guide: self.guide.as_ref(), budget: &self.budget };
        let mut columns = structure.predict(self.problem, model, values, (record, r), along)?;
        for (column, output) in columns.chunks_exact_mut(record.len).zip(measured(record)) {
            let samples = record.outputs.get(output)?.as_deref()?;
            let (floor, lag) = (
                self.floor.get(output).copied()?,
                if self.guide.is_some() { 0 } else { self.problem.lag.get(output).copied().unwrap_or(0) },
            );
            for (prediction, sample) in column.iter_mut().zip(samples) {
                *prediction = (sample - *prediction) / floor;
            }
            if lag > 0 {
                // From the end, so that what is taken off is still the position's.
                for i in (lag..column.len()).rev() {
                    column[i] = (column[i] - column[i - lag]) * std::f64::consts::FRAC_1_SQRT_2;
                }
            }
            column.iter_mut().take(record.skip).for_each(|r| *r = 0.0);
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
        self.columns(structure, own, residuals, &(0..own.len()).collect::<Vec<_>>(), 1.0)
    }

    /// The same by some of the numbers, differences taken over `stretch` times their steps.
    pub(crate) fn columns(&self, structure: &Structure, own: &[f64], residuals: &[f64], which: &[usize], stretch: f64) -> Vec<Vec<f64>> {
        let spans: Vec<std::ops::Range<usize>> = self
            .records
            .iter()
            .scan(0, |at, record| {
                let from = *at;
                *at += residuals_in(record);
                Some(from..*at)
            })
            .collect();
        let mut jobs: Vec<(usize, usize)> = Vec::new();
        // Weights of unknown curves that are far from each other are moved at the same time.
        let mut together: BTreeMap<Set, Vec<usize>> = BTreeMap::new();
        for (at, j) in which.iter().enumerate() {
            match (&structure.numbers[*j].role, &structure.numbers[*j].records) {
                (Role::Knot(unknown, knot, r), _) => together.entry((*unknown, *r, knot % tuning().fit.knots_apart)).or_default().push(at),
                (_, Some(of)) => jobs.extend(of.iter().map(|r| (at, *r))),
                (_, None) => jobs.extend((0..self.records.len()).map(|r| (at, r))),
            }
        }
        let moved: Vec<Option<(Vec<f64>, backdrive_plant::model::Model, f64)>> = which
            .iter()
            .map(|j| {
                if matches!(structure.numbers[*j].role, Role::Knot(..)) {
                    return None;
                }
                let (values, step) = moved_values(structure, own, *j, stretch);
                Some((values.clone(), structure.model(self.problem, &values)?, step))
            })
            .collect();
        let parts: Vec<Option<Vec<f64>>> = jobs
            .par_iter()
            .map(|(j, r)| {
                if self.budget.is_halted() {
                    return None;
                }
                let (values, model, step) = moved.get(*j)?.as_ref()?;
                let mut part = self.record_residuals(structure, model, values, *r)?;
                let before = residuals.get(spans[*r].clone())?;
                part.iter_mut().zip(before).for_each(|(a, b)| *a = (*a - b) / step);
                Some(part)
            })
            .collect();
        let mut jacobian = vec![vec![0.0; residuals.len()]; which.len()];
        for ((j, r), part) in jobs.iter().zip(parts) {
            if let Some(part) = part {
                jacobian[*j][spans[*r].clone()].copy_from_slice(&part);
            }
        }
        let together: Vec<(Set, Vec<usize>)> = together.into_iter().collect();
        let parts = self.knots(structure, own, residuals, which, (&together, &spans), stretch);
        for (((_, r, _), ats), columns) in together.iter().zip(parts) {
            for (at, column) in ats.iter().zip(columns.unwrap_or_default()) {
                jacobian[*at][spans[*r].clone()].copy_from_slice(&column);
            }
        }
        jacobian
    }

    /// Derivatives by the weights of unknown curves (Curtis, Powell & Reid 1974): what a weight does is over when the next that is moved along
    /// with it begins, but for what the device never forgets.
    fn knots(
        &self,
        structure: &Structure,
        own: &[f64],
        residuals: &[f64],
        which: &[usize],
        (together, spans): (&[(Set, Vec<usize>)], &[Span]),
        stretch: f64,
    ) -> Vec<Option<Vec<Vec<f64>>>> {
        let Some(model) = structure.model(self.problem, &outward(structure, own)).filter(|_| !together.is_empty()) else {
            return Vec::new();
        };
        let one = |((unknown, r, _), ats): &(Set, Vec<usize>)| {
            if self.budget.is_halted() {
                return None;
            }
            let (mut values, mut steps) = (outward(structure, own), Vec::new());
            for at in ats.iter() {
                let (changed, step) = moved_values(structure, own, which[*at], stretch);
                values[which[*at]] = changed[which[*at]];
                steps.push(step);
            }
            let part = self.record_residuals(structure, &model, &values, *r)?;
            let record = self.records.get(*r)?;
            let before = residuals.get(spans[*r].clone())?;
            let mut columns = vec![vec![0.0; part.len()]; ats.len()];
            for ((at, step), column) in ats.iter().zip(&steps).zip(&mut columns) {
                let Role::Knot(_, knot, _) = structure.numbers[which[*at]].role else { continue };
                let window = self.problem.unknown.get(*unknown)?.window(knot, tuning().fit.knots_apart, record);
                for from in (0..part.len()).step_by(record.len.max(1)) {
                    for i in window.start + from..window.end + from {
                        column[i] = (part[i] - before[i]) / step;
                    }
                }
            }
            Some(columns)
        };
        together.par_iter().map(one).collect()
    }

    /// Fits a structure from `start` on; `None` where it cannot be simulated there.
    pub fn fit(&self, structure: &Structure, start: &[f64], effort: Effort) -> Option<Fit> {
        self.fit_knowing(structure, start, effort, None)
    }

    /// The same with derivatives that another fit found, of this structure or of one that shares its first numbers: good enough for the first steps.
    ///
    /// Derivatives are carried along by the secant of each step (Broyden 1965) and computed anew when a step disappoints, every few
    /// steps, and before the fit says that it is at its end.
    pub fn fit_knowing(&self, structure: &Structure, start: &[f64], effort: Effort, known: Option<(&Structure, &Fit)>) -> Option<Fit> {
        let numbers = &structure.numbers;
        let mut own: Vec<f64> = numbers.iter().zip(start).map(|(n, v)| n.inward(*v)).collect();
        let outward = |own: &[f64]| numbers.iter().zip(own).map(|(n, x)| n.outward(*x)).collect::<Vec<f64>>();
        // A weight that a part of a recording says nothing of stays where it is.
        let priors: Vec<Option<(f64, f64)>> = numbers
            .iter()
            .zip(&own)
            .map(|(n, x)| n.prior.map(|(centre, spread)| (if matches!(n.role, Role::Knot(..)) { *x } else { centre }, spread)))
            .collect();
        let prior = |own: &[f64]| -> f64 {
            let one = |(p, x): (&Option<(f64, f64)>, &f64)| p.map_or(0.0, |(centre, spread)| ((x - centre) / spread).powi(2));
            priors.iter().zip(own).map(one).sum()
        };
        let mut residuals = self.residuals(structure, &outward(&own))?;
        let mut cost = self.cost(&residuals) + prior(&own);
        let mut jacobian = self.first_jacobian(structure, &own, &residuals, known);
        // Steps since the derivatives were computed.
        let mut age = if known.is_some() { 1 } else { 0 };
        let (mut lambda, mut steps, mut weak) = (tuning().fit.damping, 0, 0);
        // Slips that start a step earlier or later make small differences rough: wider ones are taken where narrow ones mislead.
        let mut stretch = self.stretch;
        let everything: Vec<usize> = (0..own.len()).filter(|j| self.moves(&numbers[*j])).collect();
        let mut foreseen;
        loop {
            let weights = self.weights(&residuals);
            let (mut matrix, mut slope) = normal_equations(&jacobian, &residuals, weights.as_deref());
            for (j, prior) in priors.iter().enumerate() {
                if let Some((centre, spread)) = *prior {
                    matrix[(j, j)] += 1.0 / (spread * spread);
                    slope[j] += (own[j] - centre) / (spread * spread);
                }
            }
            let free: Vec<usize> =
                everything.iter().copied().filter(|j| may_move(&numbers[*j], own[*j], slope[*j], matrix[(*j, *j)])).collect();
            foreseen = step_of(&matrix, &slope, &free, 1e-9).map_or(0.0, |step| free.iter().zip(&step).map(|(j, s)| -slope[*j] * s).sum());
            let unit = cost / residuals.len().max(1) as f64;
            self.budget.count(algebra(residuals.len(), own.len()));
            let ended = self.budget.is_over() || steps >= effort.steps || weak >= tuning().fit.weak_steps;
            if ended {
                break;
            }
            // Far from the noise a thousandth of what is left decides nothing.
            let enough = if unit > tuning().noise.near { tuning().fit.relative_tolerance * cost } else { 0.0 };
            if foreseen < (effort.tolerance * unit).max(enough) {
                if age == 0 || effort.tolerance > 1.0 {
                    break;
                }
                (jacobian, age) = (self.all_columns(structure, &own, &residuals, &everything, stretch), 0);
                continue;
            }
            let tries = if age > 0 { 2 } else { 6 };
            let mut accepted = None;
            for _ in 0..tries {
                let Some(step) = step_of(&matrix, &slope, &free, lambda) else { break };
                let mut next = own.clone();
                for (j, s) in free.iter().zip(&step) {
                    let (low, high) = numbers[*j].bounds();
                    let longest = if numbers[*j].log { tuning().fit.longest_log } else { tuning().fit.longest * (high - low) };
                    next[*j] = (own[*j] + s.clamp(-longest, longest)).clamp(low, high);
                }
                let tried = self.residuals(structure, &outward(&next)).map(|r| (self.cost(&r) + prior(&next), r));
                match tried {
                    Some((c, r)) if c < cost => {
                        accepted = Some((next, r, c));
                        break;
                    }
                    _ => lambda = (lambda * tuning().fit.more_damping).min(1e9),
                }
            }
            let Some((next, r, c)) = accepted else {
                if age == 0 {
                    if stretch >= self.widest {
                        break;
                    }
                    stretch *= tuning().fit.wider;
                }
                (jacobian, age, lambda) = (self.all_columns(structure, &own, &residuals, &everything, stretch), 0, lambda.min(1e-1));
                continue;
            };
            let ratio = (cost - c) / foreseen.max(1e-300);
            lambda = if ratio > 0.5 { lambda * tuning().fit.less_damping } else { lambda * tuning().fit.keep_damping }.max(1e-9);
            // Far from any end and hardly moving: other structures deserve the time.
            weak = if cost - c < tuning().fit.weak_decrease * cost && unit > tuning().noise.near { weak + 1 } else { 0 };
            let fresh = ratio < tuning().fit.as_predicted || age >= tuning().fit.secant_steps;
            if !fresh {
                secant(&mut jacobian, &residuals, &r, &own, &next, &matrix);
            }
            (own, residuals, cost) = (next, r, c);
            steps += 1;
            if fresh && steps < effort.steps {
                (jacobian, age) = (self.all_columns(structure, &own, &residuals, &everything, stretch), 0);
            } else {
                age += 1;
            }
        }
        Some(Fit { values: outward(&own), cost, residuals, jacobian, foreseen, steps })
    }

    fn moves(&self, number: &Number) -> bool {
        !self.own_only || number.records.is_some()
    }

    /// Derivatives by all numbers, 0 by those that do not move.
    fn all_columns(&self, structure: &Structure, own: &[f64], residuals: &[f64], which: &[usize], stretch: f64) -> Vec<Vec<f64>> {
        let mut all = vec![Vec::new(); own.len()];
        for (j, column) in which.iter().zip(self.columns(structure, own, residuals, which, stretch)) {
            all[*j] = column;
        }
        all.iter_mut().filter(|c| c.is_empty()).for_each(|c| c.resize(residuals.len(), 0.0));
        all
    }

    /// Derivatives at the start, those by stated numbers from another fit where there is one.
    fn first_jacobian(&self, structure: &Structure, own: &[f64], residuals: &[f64], known: Option<(&Structure, &Fit)>) -> Vec<Vec<f64>> {
        let Some((other, fit)) = known else {
            let moving: Vec<usize> = (0..own.len()).filter(|j| self.moves(&structure.numbers[*j])).collect();
            return self.all_columns(structure, own, residuals, &moving, self.stretch);
        };
        let still = vec![0.0; residuals.len()];
        let column = |number: &Number| {
            if !self.moves(number) {
                return Some(&still);
            }
            let place = other.numbers.iter().position(|n| n.role == number.role);
            place.and_then(|p| fit.jacobian.get(p)).filter(|c| c.len() == residuals.len())
        };
        let missing: Vec<usize> = (0..own.len()).filter(|j| column(&structure.numbers[*j]).is_none()).collect();
        let mut new = self.columns(structure, own, residuals, &missing, self.stretch).into_iter();
        structure.numbers.iter().map(|n| column(n).cloned().or_else(|| new.next()).unwrap_or_else(|| vec![0.0; residuals.len()])).collect()
    }

    /// The same, counted by another budget.
    pub fn within(&self, budget: Budget<'a>) -> Evaluator<'a> {
        Evaluator { budget, ..self.clone() }
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

/// Weights of an unknown curve that are moved at the same time: which unknown input, which record, and what is left of their number when
/// divided by `fit.knots_apart`.
type Set = (usize, usize, usize);

/// The residuals of a record.
type Span = std::ops::Range<usize>;

/// The values in the model of a fit's own.
fn outward(structure: &Structure, own: &[f64]) -> Vec<f64> {
    structure.numbers.iter().zip(own).map(|(n, x)| n.outward(*x)).collect()
}

/// What the normal equations of a step take: about 200 products in the time of a step of a linear network.
fn algebra(residuals: usize, numbers: usize) -> Steps {
    (residuals * numbers * (numbers + 1) / 2 / 200) as Steps
}

/// Outputs that a record has.
pub fn measured(record: &Record) -> impl Iterator<Item = usize> + '_ {
    record.outputs.iter().enumerate().filter(|(_, samples)| samples.is_some()).map(|(output, _)| output)
}

fn residuals_in(record: &Record) -> usize {
    measured(record).count() * record.len
}

/// Values with one number moved by its step, away from a bound, and the step taken in the fit's own unit.
fn moved_values(structure: &Structure, own: &[f64], j: usize, stretch: f64) -> (Vec<f64>, f64) {
    let number = &structure.numbers[j];
    let (low, high) = number.bounds();
    // What already spans a sample has no need of more.
    let longer = if number.coarse { stretch.clamp(-1.0, 2.0) } else { stretch };
    let mut step = (number.step * longer).clamp(-0.5 * (high - low), 0.5 * (high - low));
    if own[j] + step > high || own[j] + step < low {
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
    let edge = tuning().fit.pushed * (high - low);
    curvature > 0.0 && !(own <= low + edge && slope > 0.0) && !(own >= high - edge && slope < 0.0)
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

/// Brings derivatives in line with what a step did: the smallest change, in units of each number's own curvature, that explains it.
fn secant(jacobian: &mut [Vec<f64>], before: &[f64], after: &[f64], from: &[f64], to: &[f64], matrix: &DMatrix<f64>) {
    let step: Vec<f64> = to.iter().zip(from).map(|(a, b)| a - b).collect();
    let scaled: Vec<f64> = step.iter().enumerate().map(|(j, s)| s * matrix[(j, j)]).collect();
    let size: f64 = step.iter().zip(&scaled).map(|(a, b)| a * b).sum();
    if !(size > 0.0 && size.is_finite()) {
        return;
    }
    let mut missed: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
    for (column, s) in jacobian.iter().zip(&step).filter(|(_, s)| **s != 0.0) {
        missed.iter_mut().zip(column).for_each(|(m, c)| *m -= c * s);
    }
    for (column, s) in jacobian.iter_mut().zip(&scaled).filter(|(_, s)| **s != 0.0) {
        column.iter_mut().zip(&missed).for_each(|(c, m)| *c += m * s / size);
    }
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
