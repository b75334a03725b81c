//! One law fitted to one side: coefficients by least squares for each shape (filter, delays), the shape by Gauss-Newton steps.
//!
//! Separable least squares (Golub and Pereyra 1973). Intervals: residuals are neither white nor of constant size. The covariance is therefore the
//! sandwich with the scores summed over blocks of time (Liang and Zeger 1986). Student's t has one degree of freedom less than there are blocks.

use super::filter::{FilteredRate, delayed};
use super::law::{Law, Term, direction};
use super::prepared::{BLOCKS, Side};
use super::types::{Estimate, Gain};
use backdrive_signal::statistics::deviation;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::ops::Range;

/// What of a law is not linear in the force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shape {
    /// Time constant of the filter of speeds, s.
    pub(super) filter_s: f64,
    /// Of the motions, s.
    pub(super) delay_s: f64,
    /// Of the measured forces, s.
    pub(super) force_delay_s: f64,
}

/// The parameters of a shape, as a fit moves them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Number {
    Filter,
    Delay,
    ForceDelay,
}

/// Longest filter and delay that are looked for, s.
const LONGEST_S: f64 = 0.1;
/// A force may be recorded so much later than the law saw it, for it may be filtered on its way into the file, s.
const EARLIEST_FORCE_S: f64 = -0.02;
/// Filters and delays from which a fit starts, s.
const FILTERS_S: [f64; 3] = [3e-4, 1.5e-3, 8e-3];
const DELAYS_S: [f64; 7] = [0.0, 1e-3, 3e-3, 8e-3, 0.02, 0.04, 0.08];

/// A law fitted to one side.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) terms: Vec<Term>,
    pub(super) shape: Shape,
    /// One per term, then the offset.
    pub(super) coefficients: Vec<f64>,
    /// Mean square of the residual, of the rows that were fitted.
    pub(super) loss: f64,
}

/// The inputs of a side's terms, in the band; all but friction may be filtered before they are shaped.
pub(super) struct Ready<'a> {
    side: &'a Side,
    pub(super) force: Vec<f64>,
    error: Vec<f64>,
    own: Vec<f64>,
    own_force: Vec<f64>,
    other_force: Vec<f64>,
    speed: f64,
}

impl<'a> Ready<'a> {
    pub(super) fn of(side: &'a Side) -> Ready<'a> {
        let error: Vec<f64> = side.other.iter().zip(&side.own).map(|(r, x)| r - x).collect();
        let speeds: Vec<f64> = FilteredRate::of(&side.own, FILTERS_S[2], side.period_s);
        Ready {
            force: side.in_band(&side.force),
            error: side.smooth(&error),
            own: side.smooth(&side.own),
            own_force: side.own_force.as_deref().map(|f| side.smooth(f)).unwrap_or_default(),
            other_force: side.other_force.as_deref().map(|f| side.smooth(f)).unwrap_or_default(),
            speed: deviation(&speeds),
            side,
        }
    }

    /// Speed above which its sign is sure: what a step of the sensor looks like behind the filter.
    pub(super) fn sure_speed(&self, filter_s: f64) -> f64 {
        (2.0 * self.side.resolution / filter_s).max(0.01 * self.speed)
    }

    /// What each coefficient multiplies, at the rows that count; the last is that of the offset.
    fn columns(&self, terms: &[Term], shape: Shape) -> Vec<Vec<f64>> {
        let period = self.side.period_s;
        let late = |x: &[f64], by: f64| delayed(x, by / period);
        let at_rows = |x: &[f64]| self.side.kept.iter().map(|row| x.get(*row).copied().unwrap_or(0.0)).collect::<Vec<f64>>();
        let mut columns: Vec<Vec<f64>> = terms
            .iter()
            .map(|term| match term {
                Term::Position => at_rows(&late(&self.error, shape.delay_s)),
                Term::Rate => at_rows(&FilteredRate::of(&late(&self.error, shape.delay_s), shape.filter_s, period)),
                Term::Damping => {
                    let speed = FilteredRate::of(&late(&self.own, shape.delay_s), shape.filter_s, period);
                    at_rows(&speed).iter().map(|v| -v).collect()
                }
                Term::Friction => {
                    let speed = FilteredRate::of(&late(&self.side.own, shape.delay_s), shape.filter_s, period);
                    let sure = self.sure_speed(shape.filter_s);
                    self.side.in_band(&speed.iter().map(|v| direction(*v, sure)).collect::<Vec<f64>>())
                }
                Term::OtherForce => at_rows(&late(&self.other_force, shape.force_delay_s)),
                Term::OwnForce => at_rows(&late(&self.own_force, shape.force_delay_s)),
            })
            .collect();
        columns.push(vec![1.0; self.side.kept.len()]);
        columns
    }

    /// Coefficients for a shape by least squares over some rows, and the mean square of the residual there.
    fn linear(&self, columns: &[Vec<f64>], rows: &[Range<usize>]) -> Option<(Vec<f64>, f64)> {
        let n = columns.len();
        let all: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let (normal, right) = normal_equations(&all, &self.force, rows);
        // Of one size, or the smallest is lost in rounding.
        let scale: Vec<f64> = (0..n).map(|i| normal[(i, i)].sqrt()).map(|s| if s > 0.0 { s } else { 1.0 }).collect();
        let matrix = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] / (scale[i] * scale[j]));
        let right = DVector::from_fn(n, |i, _| right[i] / scale[i]);
        // The decomposition does not end on what is not finite.
        let finite = matrix.iter().all(|x| x.is_finite());
        let solved = finite.then(|| matrix.svd(true, true).solve(&right, 1e-13).ok())??;
        let coefficients: Vec<f64> = solved.iter().zip(&scale).map(|(c, s)| c / s).collect();
        let loss = mean_square(&self.left(columns, &coefficients), rows);
        loss.is_finite().then_some((coefficients, loss))
    }

    /// The residual of the force.
    fn left(&self, columns: &[Vec<f64>], coefficients: &[f64]) -> Vec<f64> {
        let mut left = self.force.clone();
        for (column, c) in columns.iter().zip(coefficients) {
            left.iter_mut().zip(column).for_each(|(r, x)| *r -= c * x);
        }
        left
    }

    /// What a fit leaves of the force at every row that counts.
    pub(super) fn residual(&self, fit: &Fit) -> Vec<f64> {
        self.left(&self.columns(&fit.terms, fit.shape), &fit.coefficients)
    }

    /// RMS of what each term of a fit adds to the force.
    pub(super) fn contributions(&self, fit: &Fit) -> Vec<f64> {
        let columns = self.columns(&fit.terms, fit.shape);
        columns.iter().zip(&fit.coefficients).take(fit.terms.len()).map(|(column, c)| c.abs() * deviation(column)).collect()
    }

    /// The force that a law computes from one step of the position sensor: a term that adds less cannot be distinguished from rounding.
    pub(super) fn rounding(&self, fit: &Fit) -> f64 {
        let position = fit.terms.iter().position(|t| *t == Term::Position).and_then(|i| fit.coefficients.get(i));
        position.map_or(0.0, |c| c.abs() * self.side.resolution)
    }

    /// A law fitted over some rows, from the best of many starts.
    pub(super) fn fit(&self, terms: &[Term], rows: &[Range<usize>], steps: usize) -> Option<Fit> {
        let moved = numbers(terms);
        let tries = |number: Number, all: &'static [f64]| if moved.contains(&number) { all } else { all.get(..1).unwrap_or_default() };
        let (mut best, blank): (Option<Fit>, _) = (None, Shape { filter_s: FILTERS_S[1], delay_s: 0.0, force_delay_s: 0.0 });
        let consider = |shape: Shape, best: &mut Option<Fit>| {
            let Some((coefficients, loss)) = self.linear(&self.columns(terms, shape), rows) else { return };
            if best.as_ref().is_none_or(|b| loss < b.loss) {
                *best = Some(Fit { terms: terms.to_vec(), shape, coefficients, loss });
            }
        };
        for delay_s in tries(Number::Delay, &DELAYS_S) {
            for filter_s in tries(Number::Filter, &FILTERS_S) {
                consider(Shape { delay_s: *delay_s, filter_s: *filter_s, ..blank }, &mut best);
            }
        }
        let first = best.as_ref().map_or(blank, |b| b.shape);
        for force_delay_s in tries(Number::ForceDelay, &DELAYS_S) {
            consider(Shape { force_delay_s: *force_delay_s, ..first }, &mut best);
        }
        self.refined(best?, rows, steps)
    }

    /// Gauss-Newton steps from a fit, over some rows.
    pub(super) fn refined(&self, start: Fit, rows: &[Range<usize>], most: usize) -> Option<Fit> {
        let moved = numbers(&start.terms);
        let (coefficients, loss) = self.linear(&self.columns(&start.terms, start.shape), rows)?;
        let mut fit = Fit { coefficients, loss, ..start };
        let mut damping = 1e-3;
        for _ in 0..most {
            if moved.is_empty() {
                break;
            }
            let columns = self.columns(&fit.terms, fit.shape);
            let left = self.left(&columns, &fit.coefficients);
            let slopes: Vec<Vec<f64>> = moved.iter().map(|n| self.slope(&fit, *n)).collect();
            let all: Vec<&[f64]> = columns.iter().chain(&slopes).map(Vec::as_slice).collect();
            let (normal, right) = normal_equations(&all, &left, rows);
            if !normal.iter().all(|x| x.is_finite()) {
                break;
            }
            let mut better = None;
            while damping < 1e4 {
                let mut damped = normal.clone();
                for i in columns.len()..all.len() {
                    damped[(i, i)] *= 1.0 + damping;
                }
                let Ok(step) = damped.svd(true, true).solve(&right, 1e-14) else { break };
                let mut shape = fit.shape;
                for (number, step) in moved.iter().zip(step.iter().skip(columns.len())) {
                    shape = self.stepped(shape, *number, *step);
                }
                match self.linear(&self.columns(&fit.terms, shape), rows) {
                    Some((coefficients, loss)) if loss < fit.loss => {
                        better = Some(Fit { terms: fit.terms.clone(), shape, coefficients, loss });
                        damping *= 0.1;
                        break;
                    }
                    _ => damping = (damping * 10.0).max(1e-6),
                }
            }
            let Some(better) = better else { break };
            let done = better.loss > fit.loss * (1.0 - 1e-5);
            fit = better;
            if done {
                break;
            }
        }
        Some(fit)
    }

    /// A shape with one of its parameters moved by a step: the filter in its logarithm, delays in rows.
    fn stepped(&self, shape: Shape, number: Number, step: f64) -> Shape {
        let period = self.side.period_s;
        match number {
            Number::Filter => {
                Shape { filter_s: (shape.filter_s * step.clamp(-2.0, 2.0).exp()).clamp(self.shortest_filter(), LONGEST_S), ..shape }
            }
            Number::Delay => Shape { delay_s: (shape.delay_s + step * period).clamp(-2.0 * period, LONGEST_S), ..shape },
            Number::ForceDelay => {
                Shape { force_delay_s: (shape.force_delay_s + step * period).clamp(EARLIEST_FORCE_S, LONGEST_S), ..shape }
            }
        }
    }

    /// Below a fifth of a row a filter filters nothing.
    fn shortest_filter(&self) -> f64 {
        0.2 * self.side.period_s
    }

    /// How the predicted force changes with a number of the shape.
    fn slope(&self, fit: &Fit, number: Number) -> Vec<f64> {
        let step = if number == Number::Filter { 1e-3 } else { 1e-2 };
        let (ahead, back) = (self.nudged(fit.shape, number, step), self.nudged(fit.shape, number, -step));
        let sum = |shape: Shape| {
            let columns = self.columns(&fit.terms, shape);
            let mut sum = vec![0.0; self.force.len()];
            for (column, c) in columns.iter().zip(&fit.coefficients) {
                sum.iter_mut().zip(column).for_each(|(s, x)| *s += c * x);
            }
            sum
        };
        sum(ahead).iter().zip(sum(back)).map(|(a, b)| (a - b) / (2.0 * step)).collect()
    }

    /// As [`Ready::stepped`], also beyond the ends.
    fn nudged(&self, shape: Shape, number: Number, step: f64) -> Shape {
        let period = self.side.period_s;
        match number {
            Number::Filter => Shape { filter_s: shape.filter_s * step.exp(), ..shape },
            Number::Delay => Shape { delay_s: shape.delay_s + step * period, ..shape },
            Number::ForceDelay => Shape { force_delay_s: shape.force_delay_s + step * period, ..shape },
        }
    }

    /// The parameters of a fit with their intervals.
    pub(super) fn told(&self, fit: &Fit) -> Told {
        let moved: Vec<Number> = numbers(&fit.terms).into_iter().filter(|n| !self.at_an_end(fit.shape, *n)).collect();
        let columns = self.columns(&fit.terms, fit.shape);
        let left = self.left(&columns, &fit.coefficients);
        let slopes: Vec<Vec<f64>> = moved.iter().map(|n| self.slope(fit, *n)).collect();
        let all: Vec<&[f64]> = columns.iter().chain(&slopes).map(Vec::as_slice).collect();
        let sd = deviations(&all, &left, &self.side.blocks).unwrap_or_else(|| vec![f64::NAN; all.len()]);
        let t = StudentsT::new(0.0, 1.0, (BLOCKS - 1) as f64).map_or(2.1, |t| t.inverse_cdf(0.975));
        let about = |value: f64, sd: f64| {
            let half = if sd.is_finite() { t * sd } else { value.abs() };
            Estimate { value, ci95: [value - half, value + half] }
        };
        let estimate = |i: usize| about(fit.coefficients.get(i).copied().unwrap_or(0.0), sd.get(i).copied().unwrap_or(f64::NAN));
        let gains = fit.terms.iter().enumerate().map(|(i, term)| Gain { term: *term, estimate: estimate(i) }).collect();
        let number = |number: Number, value: f64| {
            let used = numbers(&fit.terms).contains(&number);
            let sd = moved.iter().position(|n| *n == number).and_then(|i| sd.get(columns.len() + i)).copied();
            used.then(|| match (number, sd) {
                (Number::Filter, Some(sd)) => Estimate { value, ci95: [value * (-t * sd).exp(), value * (t * sd).exp()] },
                (_, Some(sd)) => about(value, sd * self.side.period_s),
                // It stands at the end of what is looked through.
                (_, None) => Estimate { value, ci95: [value.min(0.0), value.max(0.0)] },
            })
        };
        Told {
            gains,
            offset: estimate(fit.terms.len()),
            filter_s: number(Number::Filter, fit.shape.filter_s),
            delay_s: number(Number::Delay, fit.shape.delay_s),
            force_delay_s: number(Number::ForceDelay, fit.shape.force_delay_s),
        }
    }

    fn at_an_end(&self, shape: Shape, number: Number) -> bool {
        let period = self.side.period_s;
        let (value, low, high) = match number {
            Number::Filter => (shape.filter_s, self.shortest_filter(), LONGEST_S),
            Number::Delay => (shape.delay_s, -2.0 * period, LONGEST_S),
            Number::ForceDelay => (shape.force_delay_s, EARLIEST_FORCE_S, LONGEST_S),
        };
        value <= low + 1e-6 * period || value >= high - 1e-6 * period
    }

    /// The law of a fit.
    pub(super) fn law(&self, fit: &Fit) -> Law {
        Law {
            terms: fit.terms.iter().copied().zip(fit.coefficients.iter().copied()).collect(),
            offset: fit.coefficients.last().copied().unwrap_or(0.0),
            filter_s: fit.shape.filter_s,
            delay_s: fit.shape.delay_s,
            force_delay_s: fit.shape.force_delay_s,
            sure_speed: self.sure_speed(fit.shape.filter_s),
            limit: self.side.limit,
        }
    }
}

/// The parameters of a fit with their intervals.
pub(super) struct Told {
    pub(super) gains: Vec<Gain>,
    pub(super) offset: Estimate,
    pub(super) filter_s: Option<Estimate>,
    pub(super) delay_s: Option<Estimate>,
    pub(super) force_delay_s: Option<Estimate>,
}

/// Which parameters of the shape a law depends on.
fn numbers(terms: &[Term]) -> Vec<Number> {
    let mut numbers = Vec::new();
    if terms.iter().any(|t| t.is_speed()) {
        numbers.push(Number::Filter);
    }
    if terms.iter().any(|t| !t.is_force()) {
        numbers.push(Number::Delay);
    }
    if terms.iter().any(|t| t.is_force()) {
        numbers.push(Number::ForceDelay);
    }
    numbers
}

/// The values of some ranges of rows.
fn over<'a>(rows: &'a [Range<usize>], values: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    rows.iter().flat_map(|r| values.get(r.clone()).unwrap_or_default().iter().copied())
}

/// Mean square over some ranges of rows.
pub(super) fn mean_square(values: &[f64], rows: &[Range<usize>]) -> f64 {
    let count: usize = rows.iter().map(ExactSizeIterator::len).sum();
    over(rows, values).map(|x| x * x).sum::<f64>() / count.max(1) as f64
}

fn normal_equations(columns: &[&[f64]], left: &[f64], rows: &[Range<usize>]) -> (DMatrix<f64>, DVector<f64>) {
    let dot = |a: &[f64], b: &[f64]| over(rows, a).zip(over(rows, b)).map(|(x, y)| x * y).sum::<f64>();
    let at = |i: usize| columns.get(i).copied().unwrap_or_default();
    let n = columns.len();
    let mut normal = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let product = dot(at(i), at(j));
            (normal[(i, j)], normal[(j, i)]) = (product, product);
        }
    }
    (normal, DVector::from_fn(n, |i, _| dot(at(i), left)))
}

/// Standard deviation of each coefficient: the sandwich over blocks.
fn deviations(columns: &[&[f64]], left: &[f64], blocks: &[Range<usize>]) -> Option<Vec<f64>> {
    let whole: Vec<Range<usize>> = blocks.to_vec();
    let (normal, _) = normal_equations(columns, left, &whole);
    // Of one size, or the inverse is lost in rounding.
    let n = columns.len();
    let scale: Vec<f64> = (0..n).map(|i| normal[(i, i)].sqrt()).map(|s| if s > 0.0 { s } else { 1.0 }).collect();
    let inverse = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] / (scale[i] * scale[j])).try_inverse()?;
    let mut scores = DMatrix::zeros(n, n);
    for block in blocks {
        let rows = std::slice::from_ref(block);
        let score = DVector::from_fn(n, |i, _| {
            let column = columns.get(i).copied().unwrap_or_default();
            over(rows, column).zip(over(rows, left)).map(|(x, r)| x * r).sum::<f64>() / scale[i]
        });
        scores += &score * score.transpose();
    }
    let few = blocks.len() as f64 / (blocks.len() as f64 - 1.0);
    let covariance = &inverse * scores * &inverse * few;
    Some((0..n).map(|i| covariance[(i, i)].max(0.0).sqrt() / scale[i]).collect())
}
