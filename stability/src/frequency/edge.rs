//! The stability limit of a measured loop, with an interval.

use super::local::LocalFit;
use backdrive_control::margins::{Crossing, at_the_bottom, between};
use nalgebra::{Complex, DMatrix, Schur};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

type Matrix = DMatrix<Complex<f64>>;

/// A line locates the loop if `|L|` is this many times its sigma; noise is that large on 3 lines in 10000.
pub(super) const TOLD: f64 = 4.0;
/// Radius, in sigmas of one component, of the disc that holds 95 %.
const DISC: f64 = 2.448;
/// No larger gain is asked for.
const LARGEST: f64 = 1e4;
/// Half-width that stays where there is no noise: lines are interpolated, records rounded.
const FLOOR: f64 = 0.003;
/// Below this the lowest line is near enough to DC to decide in which direction the loop runs away, Hz.
const NEAR_DC_HZ: f64 = 8.0;

/// The gain at which a loop is at its stability limit.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Edge {
    /// mu*lambda (or multiples of the recorded gain, where that is unknown); `None` where no line reaches the stability limit.
    pub gain: Option<f64>,
    /// 95 % interval of the stability limit; over several amplitudes the upper end is `None` where one of them has no limit.
    pub ci95: Option<(f64, Option<f64>)>,
    /// Frequency at which it oscillates there, Hz; 0 where it runs away without oscillating.
    pub frequency_hz: Option<f64>,
    /// Where no stability limit was found: there is none below this gain within the lines, by their discs of 95 %; at most 10000.
    pub at_least: Option<f64>,
    /// Up to this gain no stability limit can be hidden by a line with too much noise or by frequencies above the highest line; `None`: at any gain.
    pub told_to: Option<f64>,
}

impl Edge {
    /// The whole interval in which the stability limit may lie: lower and upper end, the upper `None` where it is open.
    pub fn interval(&self) -> Option<(f64, Option<f64>)> {
        self.ci95.or(self.at_least.map(|least| (least, None)))
    }
}

/// A loop per unit gain on lines, with draws of its uncertainty.
#[derive(Debug, Clone)]
pub(super) struct Loop {
    pub hz: Vec<f64>,
    pub nominal: Vec<Matrix>,
    /// Root mean square over the elements that feed back, of one component.
    pub sigma: Vec<DMatrix<f64>>,
    pub draws: Vec<Vec<Matrix>>,
    pub freedom: Vec<f64>,
}

impl Loop {
    /// A loop that was estimated in one piece.
    pub(super) fn measured(fit: &LocalFit, draws: usize, seed: u64) -> Loop {
        // Each draw has its own stream: the answer does not depend on how many threads there are.
        let draw = |index: usize| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(index as u64);
            fit.draw(&mut rng)
        };
        let draws = (0..draws).into_par_iter().map(draw).collect();
        Loop { hz: fit.hz.clone(), nominal: fit.value.clone(), sigma: fit.sigma(), draws, freedom: fit.freedom.clone() }
    }

    /// A part whose response is known.
    pub(super) fn known(hz: &[f64], value: Vec<Matrix>) -> Loop {
        let sigma = value.iter().map(|m| DMatrix::zeros(m.nrows(), m.ncols())).collect();
        Loop { hz: hz.to_vec(), nominal: value, sigma, draws: Vec::new(), freedom: vec![f64::INFINITY; hz.len()] }
    }

    /// Combines two parts line by line, where both have the line.
    pub(super) fn combine(&self, other: &Loop, f: impl Fn(&Matrix, &Matrix) -> Matrix) -> Loop {
        let pairs: Vec<(usize, usize)> = self
            .hz
            .iter()
            .enumerate()
            .filter_map(|(i, hz)| other.hz.iter().position(|h| (h - hz).abs() < 1e-6 * hz).map(|j| (i, j)))
            .collect();
        let at =
            |part: &Loop, draw: usize, line: usize| part.draws.get(draw).and_then(|d| d.get(line)).unwrap_or(&part.nominal[line]).clone();
        let nominal: Vec<Matrix> = pairs.iter().map(|(i, j)| f(&self.nominal[*i], &other.nominal[*j])).collect();
        let count = self.draws.len().max(other.draws.len());
        let draws: Vec<Vec<Matrix>> =
            (0..count).map(|d| pairs.iter().map(|(i, j)| f(&at(self, d, *i), &at(other, d, *j))).collect()).collect();
        let sigma = (0..pairs.len())
            .map(|line| {
                let mut sum = DMatrix::zeros(nominal[line].nrows(), nominal[line].ncols());
                for d in &draws {
                    sum += (&d[line] - &nominal[line]).map(|x| x.norm_sqr());
                }
                sum.map(|x: f64| (0.5 * x / count.max(1) as f64).sqrt())
            })
            .collect();
        let freedom = pairs.iter().map(|(i, j)| self.freedom[*i].min(other.freedom[*j])).collect();
        Loop { hz: pairs.iter().map(|(i, _)| self.hz[*i]).collect(), nominal, sigma, draws, freedom }
    }

    /// One loop of several, the others open.
    pub(super) fn single(&self, axis: usize) -> Loop {
        let pick = |m: &Matrix| Matrix::from_element(1, 1, m[(axis, axis)]);
        Loop {
            hz: self.hz.clone(),
            nominal: self.nominal.iter().map(pick).collect(),
            sigma: self.sigma.iter().map(|s| DMatrix::from_element(1, 1, s[(axis, axis)])).collect(),
            draws: self.draws.iter().map(|d| d.iter().map(pick).collect()).collect(),
            freedom: self.freedom.clone(),
        }
    }

    fn spread(&self, line: usize) -> f64 {
        let s = &self.sigma[line];
        // The error of an eigenvalue is about that of a row.
        (s.iter().map(|x| x * x).sum::<f64>() / s.nrows().max(1) as f64).sqrt()
    }

    /// Whether each line locates the loop.
    pub(super) fn told(&self) -> Vec<bool> {
        (0..self.hz.len())
            .map(|line| {
                let largest = eigenvalues(&self.nominal[line]).iter().map(|e| e.norm()).fold(0.0, f64::max);
                largest > 0.0 && largest >= TOLD * self.spread(line)
            })
            .collect()
    }

    /// The stability limit; `other` is the same loop estimated with another resolution: the difference is bias.
    pub(super) fn edge(&self, other: Option<&Loop>) -> Edge {
        let told = self.told();
        let told_to = [self.bound(|line| !told[line]), self.above_the_band()].into_iter().flatten().min_by(f64::total_cmp);
        let Some(nominal) = crossing(&self.hz, &self.nominal, &told) else {
            let least = self.bound(|_| true);
            return Edge { at_least: Some(least.unwrap_or(LARGEST).min(LARGEST)), told_to, ..Edge::default() };
        };
        let bias = other.and_then(|o| crossing(&o.hz, &o.nominal, &o.told())).map_or(0.0, |o| (o.factor / nominal.factor).ln().abs());
        // Twice the length has a quarter of the bias: a third of the difference is to be expected, half of it is allowed for.
        let fixed = 0.5 * bias.min(0.5);
        let nearest = self.hz.partition_point(|f| *f < nominal.frequency_hz).min(self.hz.len().saturating_sub(1));
        let few = student(self.freedom.get(nearest).copied().unwrap_or(1.0));
        let mut drawn: Vec<f64> =
            self.draws.iter().map(|d| crossing(&self.hz, d, &told).map_or(f64::INFINITY, |c| (c.factor / nominal.factor).ln())).collect();
        drawn.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let at = (share * drawn.len() as f64) as usize;
            drawn.get(at.min(drawn.len().saturating_sub(1))).copied().unwrap_or(0.0)
        };
        let widen = |random: f64| ((few * random.max(0.0)).powi(2) + fixed * fixed + FLOOR * FLOOR).sqrt();
        let (low, high) = (widen(-quantile(0.025)), widen(quantile(0.975)));
        let (lower, upper) = (nominal.factor * (-low).exp(), nominal.factor * high.exp());
        if !upper.is_finite() {
            // One draw in forty does not cross at all: what crosses may be noise.
            let least = self.bound(|_| true).map_or(lower, |bound| bound.min(lower));
            return Edge { at_least: Some(least), told_to, ..Edge::default() };
        }
        Edge {
            gain: Some(nominal.factor),
            ci95: Some((lower, Some(upper))),
            frequency_hz: Some(nominal.frequency_hz),
            at_least: None,
            told_to,
        }
    }

    /// The gain at which the loop is down to a half at its highest lines: above them it is taken to fall further.
    fn above_the_band(&self) -> Option<f64> {
        let from = self.hz.len() - (self.hz.len() / 20).clamp(1, 10).min(self.hz.len());
        let size = |line: usize| {
            let largest = eigenvalues(&self.nominal[line]).iter().map(|e| e.norm()).fold(0.0, f64::max);
            largest + self.spread(line)
        };
        let mean = (from..self.hz.len()).map(size).sum::<f64>() / (self.hz.len() - from).max(1) as f64;
        (mean > 0.0).then(|| 0.5 / mean)
    }

    /// The smallest gain at which the disc of one of these lines reaches the critical point; `None` where none does.
    fn bound(&self, of: impl Fn(usize) -> bool) -> Option<f64> {
        let reach = (0..self.hz.len()).filter(|line| of(*line)).flat_map(|line| {
            let radius = DISC * student(self.freedom[line]) * self.spread(line);
            eigenvalues(&self.nominal[line]).into_iter().filter_map(move |l| {
                let half_chord = radius * radius - l.im * l.im;
                (half_chord >= 0.0).then(|| l.re + half_chord.sqrt())
            })
        });
        reach.filter(|x| *x > 0.0).max_by(f64::total_cmp).map(|x| 1.0 / x)
    }
}

/// By how much the 97.5 % point of Student's distribution lies beyond the normal one's.
fn student(freedom: f64) -> f64 {
    if !freedom.is_finite() || freedom > 200.0 {
        return 1.0;
    }
    StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(6.5, |t| t.inverse_cdf(0.975) / 1.959_964)
}

/// The smallest factor at which an eigenvalue of the loop passes through +1, over the lines with information.
pub(crate) fn crossing(hz: &[f64], l: &[Matrix], told: &[bool]) -> Option<Crossing> {
    let mut best: Option<Crossing> = None;
    let mut keep = |c: Option<Crossing>| {
        if let Some(c) = c.filter(|c| best.is_none_or(|b| c.factor < b.factor)) {
            best = Some(c);
        }
    };
    let mut before: Option<(usize, Vec<Complex<f64>>)> = None;
    for line in 0..hz.len().min(l.len()) {
        if !told[line] {
            before = None;
            continue;
        }
        let mut now = eigenvalues(&l[line]);
        if let Some((last, then)) = &before {
            now = matched(then, now);
            for (a, b) in then.iter().zip(&now) {
                keep(between((hz[*last], *a), (hz[line], *b)));
            }
        } else if line == 0 && hz[0] <= NEAR_DC_HZ {
            let next = l.get(1).filter(|_| told.get(1) == Some(&true)).map(|m| matched(&now, eigenvalues(m)));
            for (i, a) in now.iter().enumerate() {
                let second = next.as_ref().and_then(|n| Some((*hz.get(1)?, *n.get(i)?)));
                keep(at_the_bottom((hz[0], *a), second));
            }
        }
        before = Some((line, now));
    }
    best
}

/// The loci of the eigenvalues over the lines with information.
pub(super) fn loci(l: &[Matrix], told: &[bool]) -> Vec<Vec<Complex<f64>>> {
    let mut loci: Vec<Vec<Complex<f64>>> = Vec::new();
    let mut before: Option<Vec<Complex<f64>>> = None;
    for m in l.iter().zip(told).filter(|(_, told)| **told).map(|(m, _)| m) {
        let now = before.as_ref().map_or_else(|| eigenvalues(m), |then| matched(then, eigenvalues(m)));
        loci.resize(now.len(), Vec::new());
        loci.iter_mut().zip(&now).for_each(|(locus, value)| locus.push(*value));
        before = Some(now);
    }
    loci
}

/// The values in the order of those that they continue.
fn matched(then: &[Complex<f64>], mut now: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
    for (i, a) in then.iter().enumerate() {
        let nearest = (i..now.len()).min_by(|x, y| (now[*x] - a).norm_sqr().total_cmp(&(now[*y] - a).norm_sqr()));
        if let Some(nearest) = nearest {
            now.swap(i, nearest);
        }
    }
    now
}

/// Eigenvalues of a small matrix; empty where they cannot be found.
pub(crate) fn eigenvalues(m: &Matrix) -> Vec<Complex<f64>> {
    match m.nrows() {
        0 => Vec::new(),
        1 => vec![m[(0, 0)]],
        2 => {
            let half = (m[(0, 0)] + m[(1, 1)]) * 0.5;
            let root = (half * half - (m[(0, 0)] * m[(1, 1)] - m[(0, 1)] * m[(1, 0)])).sqrt();
            vec![half + root, half - root]
        }
        _ if m.iter().all(|x| x.re.is_finite() && x.im.is_finite()) => Schur::try_new(m.clone(), f64::EPSILON, 1000)
            .and_then(|s| s.eigenvalues())
            .map_or_else(Vec::new, |e| e.iter().copied().collect()),
        _ => Vec::new(),
    }
}
