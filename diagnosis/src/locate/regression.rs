//! The laws that a force may follow. The force is regressed on everything that moves at its place, and each law is tested on held-out parts of the
//! recordings.

use super::law::{Form, Law, Point, Variable};
use super::period::{Ripple, least_squares};
use super::reversals::Reversals;
use backdrive_signal::statistics::rms;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// Everything at a place, all runs one after the other.
pub(super) struct Samples {
    pub force: Vec<f64>,
    /// Displacement and velocity across the place; empty at a signal.
    pub x: Vec<f64>,
    pub v: Vec<f64>,
    pub acceleration: Vec<f64>,
    pub signal: Vec<f64>,
    pub signal_rate: Vec<f64>,
    pub time: Vec<f64>,
    /// Number of the run of each sample.
    pub run: Vec<usize>,
    pub reversals: Reversals,
}

impl Samples {
    /// Samples that carry independent information about a remainder: from the variance of means over blocks.
    pub fn independent(&self, remainder: &[f64]) -> f64 {
        let n = remainder.len();
        let block = (n / 64).max(1);
        let mean = remainder.iter().sum::<f64>() / n.max(1) as f64;
        let variance = remainder.iter().map(|r| (r - mean) * (r - mean)).sum::<f64>() / n.max(1) as f64;
        let means: Vec<f64> = remainder.chunks_exact(block).map(|c| c.iter().sum::<f64>() / block as f64 - mean).collect();
        let of_means = means.iter().map(|m| m * m).sum::<f64>() / means.len().max(1) as f64;
        if variance > 0.0 { n as f64 / (block as f64 * of_means / variance).clamp(1.0, n as f64) } else { n as f64 }
    }

    /// All laws that could hold here, best first by the share that they explain of parts they were not fitted to.
    pub fn laws(&self, ripple: Option<&Ripple>) -> Vec<Law> {
        let n = self.force.len();
        // The sign of a velocity near rest is noise; the direction since a turning point is not.
        let sides = &self.reversals.direction;
        let direction: Vec<f64> = sides.iter().map(|side| f64::from(*side)).collect();
        let speed: Vec<f64> = self.v.iter().map(|v| v.abs()).collect();
        let none: Vec<i8> = vec![0; n];
        let mut laws = vec![self.proportional(Variable::Constant, &vec![1.0; n])];
        if self.x.len() == n {
            laws.push(self.proportional(Variable::Direction, &direction));
            for (variable, z) in
                [(Variable::Velocity, &self.v), (Variable::Displacement, &self.x), (Variable::Acceleration, &self.acceleration)]
            {
                laws.push(self.proportional(variable, z));
            }
            laws.push(self.polynomial(Variable::Velocity, &self.v, |k, v| [1.0, direction[k], v, v * v.abs()]));
            laws.push(self.polynomial(Variable::Displacement, &self.x, |_, x| [1.0, x, x * x, x * x * x]));
            laws.push(self.binned(Variable::Velocity, &speed, sides, Bins::Even(BINS / 2)));
            laws.push(self.binned(Variable::Displacement, &self.x, &none, Bins::Even(BINS)));
            laws.push(self.binned(Variable::Acceleration, &self.acceleration, &none, Bins::Even(BINS)));
            laws.push(self.binned(Variable::DisplacementByDirection, &self.x, sides, Bins::Even(BINS / 2)));
            laws.push(self.binned(Variable::SinceReversal, &self.reversals.distance, sides, Bins::Log(BINS / 2)));
            laws.push(self.binned(Variable::TimeSinceReversal, &self.reversals.time, sides, Bins::Log(BINS / 2)));
            if let Some(ripple) = ripple {
                let phase: Vec<f64> = self.x.iter().map(|x| x.rem_euclid(ripple.period)).collect();
                laws.push(self.binned(Variable::Ripple, &phase, &none, Bins::Even(BINS / 2)));
            }
        }
        if self.signal.len() == n {
            for (variable, z) in [(Variable::Signal, &self.signal), (Variable::SignalRate, &self.signal_rate)] {
                laws.push(self.proportional(variable, z));
                laws.push(self.polynomial(variable, z, |_, z| [1.0, z, z * z, z * z * z]));
                laws.push(self.binned(variable, z, &none, Bins::FinerAtZero(BINS)));
            }
        }
        laws.push(self.binned(Variable::Time, &self.time, &none, Bins::Even(BINS)));
        laws.sort_by(|a, b| b.held_out_share.total_cmp(&a.held_out_share));
        laws
    }

    fn proportional(&self, variable: Variable, z: &[f64]) -> Law {
        let slope = |keep: &dyn Fn(usize) -> bool| {
            let (mut fz, mut zz) = (0.0, 0.0);
            (0..z.len()).filter(|k| keep(*k)).for_each(|k| {
                fz += self.force[k] * z[k];
                zz += z[k] * z[k];
            });
            if zz > 0.0 { fz / zz } else { 0.0 }
        };
        let halves = [slope(&|k| self.half(k) == 0), slope(&|k| self.half(k) == 1)];
        let c = slope(&|_| true);
        let fitted: Vec<f64> = z.iter().map(|z| c * z).collect();
        let other: Vec<f64> = (0..z.len()).map(|k| halves[1 - self.half(k)] * z[k]).collect();
        let mut law = self.tested(variable, Form::Proportional, 1, fitted, &other);
        law.curve = self.bin_means(z, &vec![0; z.len()], Bins::FinerAtZero(BINS)).0;
        law
    }

    fn polynomial(&self, variable: Variable, z: &[f64], basis: impl Fn(usize, f64) -> [f64; 4]) -> Law {
        let size = rms(z).max(f64::MIN_POSITIVE);
        let row = |k: usize| basis(k, z[k] / size);
        let fit = |half: Option<usize>| {
            let kept = (0..z.len()).filter(|k| half.is_none_or(|h| self.half(*k) == h));
            least_squares(kept.map(|k| (row(k), self.force[k]))).unwrap_or([0.0; 4])
        };
        let at = |c: &[f64; 4], k: usize| row(k).iter().zip(c).map(|(b, c)| b * c).sum::<f64>();
        let (all, halves) = (fit(None), [fit(Some(0)), fit(Some(1))]);
        let fitted: Vec<f64> = (0..z.len()).map(|k| at(&all, k)).collect();
        let other: Vec<f64> = (0..z.len()).map(|k| at(&halves[1 - self.half(k)], k)).collect();
        let mut law = self.tested(variable, Form::Smooth, 4, fitted, &other);
        law.curve = self.bin_means(z, &vec![0; z.len()], Bins::FinerAtZero(BINS)).0;
        law
    }

    fn binned(&self, variable: Variable, z: &[f64], sides: &[i8], bins: Bins) -> Law {
        let (curve, of_sample, count) = self.bin_means(z, sides, bins);
        let mut sums = [vec![(0.0, 0.0); count], vec![(0.0, 0.0); count]];
        for (k, bin) in of_sample.iter().enumerate() {
            let cell = &mut sums[self.half(k)][*bin];
            cell.0 += self.force[k];
            cell.1 += 1.0;
        }
        let mean = |cell: &(f64, f64)| if cell.1 > 0.0 { cell.0 / cell.1 } else { 0.0 };
        let all: Vec<f64> = (0..count).map(|b| mean(&(sums[0][b].0 + sums[1][b].0, sums[0][b].1 + sums[1][b].1))).collect();
        let fitted = of_sample.iter().map(|bin| all[*bin]).collect();
        let other: Vec<f64> = of_sample.iter().enumerate().map(|(k, bin)| mean(&sums[1 - self.half(k)][*bin])).collect();
        let mut law = self.tested(variable, Form::Binned, curve.len(), fitted, &other);
        law.curve = curve;
        if variable == Variable::Velocity {
            // Tabulated by speed and direction, shown over velocity.
            law.curve.iter_mut().for_each(|p| p.at *= f64::from(p.direction));
            law.curve.sort_by(|a, b| a.at.total_cmp(&b.at));
        }
        law
    }

    /// Which of the two halves a sample belongs to: each run is cut into blocks, taken in turn.
    fn half(&self, k: usize) -> usize {
        let block = (self.force.len() / 16).max(1);
        (k / block) % 2
    }

    /// Points, the bin of each sample, and the number of bins.
    fn bin_means(&self, z: &[f64], sides: &[i8], bins: Bins) -> (Vec<Point>, Vec<usize>, usize) {
        let peak = z.iter().fold(0.0_f64, |m, z| m.max(z.abs()));
        let rms = rms(z);
        let (low, high) = z.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(*z), h.max(*z)));
        let n = bins.count();
        let place = |z: f64| -> f64 {
            match bins {
                Bins::Even(_) => (z - low) / (high - low).max(f64::MIN_POSITIVE),
                // Finer about zero, and with a boundary at it.
                Bins::FinerAtZero(_) => 0.5 + 0.5 * (BOW * z / rms).asinh() / (BOW * peak / rms).asinh(),
                Bins::Log(_) => 1.0 + (z.abs() / peak).max(1e-3).log10() / 3.0,
            }
        };
        let bin = |z: f64, side: i8| {
            let at = place(z);
            let at = if at.is_finite() { at } else { 0.5 };
            ((at * n as f64) as usize).min(n - 1) + n * usize::from(side < 0)
        };
        let of_sample: Vec<usize> = z.iter().zip(sides).map(|(z, side)| bin(*z, *side)).collect();
        let mut cells = vec![(0usize, 0.0, 0.0, 0.0, 0i8); 2 * n];
        for (k, bin) in of_sample.iter().enumerate() {
            let cell = &mut cells[*bin];
            cell.0 += 1;
            cell.1 += z[k];
            cell.2 += self.force[k];
            cell.3 += self.force[k] * self.force[k];
            cell.4 = sides[k];
        }
        let point = |(count, z, f, ff, direction): &(usize, f64, f64, f64, i8)| {
            let c = *count as f64;
            let mean = f / c;
            Point { at: z / c, direction: *direction, mean, spread: (ff / c - mean * mean).max(0.0).sqrt(), count: *count }
        };
        (cells.iter().filter(|c| c.0 > 0).map(point).collect(), of_sample, 2 * n)
    }

    fn tested(&self, variable: Variable, form: Form, numbers: usize, fitted: Vec<f64>, other: &[f64]) -> Law {
        let all: f64 = self.force.iter().map(|f| f * f).sum();
        let left = |g: &[f64]| self.force.iter().zip(g).map(|(f, g)| (f - g) * (f - g)).sum::<f64>();
        let share_of = |g: &[f64]| if all > 0.0 { 1.0 - left(g) / all } else { 0.0 };
        let (share, held_out_share) = (share_of(&fitted), share_of(other));
        let remainder: Vec<f64> = self.force.iter().zip(&fitted).map(|(f, g)| f - g).collect();
        let freedom = (self.independent(&remainder) - numbers as f64).max(1.0);
        let f_statistic = (share.max(0.0) / numbers as f64) / ((1.0 - share).max(1e-12) / freedom);
        let p_value = FisherSnedecor::new(numbers as f64, freedom).map_or(1.0, |d| 1.0 - d.cdf(f_statistic));
        Law { variable, form, numbers, share, held_out_share, f_statistic, p_value, evidence: None, curve: Vec::new(), fitted }
    }
}

#[derive(Clone, Copy)]
enum Bins {
    /// Evenly over the range.
    Even(usize),
    /// Finer about zero.
    FinerAtZero(usize),
    /// In decades below the largest, three of them.
    Log(usize),
}

impl Bins {
    fn count(self) -> usize {
        match self {
            Bins::Even(n) | Bins::FinerAtZero(n) | Bins::Log(n) => n.max(1),
        }
    }
}

/// Bins of a curve; even, so that one boundary is at zero.
const BINS: usize = 32;
/// How much finer bins are about zero.
const BOW: f64 = 3.0;
