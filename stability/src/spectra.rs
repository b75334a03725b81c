//! Cross-spectra of a record: averaged over segments (Welch), or over the periods of what shook it.

use nalgebra::{Complex, DMatrix};
use realfft::RealFftPlanner;
use serde::Serialize;
use std::f64::consts::TAU;
use std::ops::Range;

/// How a record was cut, windowed and averaged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Averaging {
    /// What a segment is multiplied by.
    pub window: Window,
    /// Length of a segment, s.
    pub segment_s: f64,
    /// Share of a segment that the next one has too, on average.
    pub overlap: f64,
    /// How many segments.
    pub segments: usize,
    /// The equivalent number of independent segments.
    pub averages: f64,
    /// From line to line, Hz.
    pub resolution_hz: f64,
}

/// What a segment is multiplied by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Window {
    /// Raised cosine, trend removed in each segment.
    Hann,
    /// Nothing: a segment is a whole period of the excitation, and nothing leaks.
    Periods,
}

/// Spectra of several signals with each other.
#[derive(Debug, Clone)]
pub struct CrossSpectra {
    /// Hz, rising, 0 left out.
    pub hz: Vec<f64>,
    /// At each line `S[(a, b)] = mean X_a conj(X_b)`, of the order of the columns; unit of a times unit of b.
    pub lines: Vec<DMatrix<Complex<f64>>>,
    /// How they were averaged.
    pub averaging: Averaging,
}

impl CrossSpectra {
    /// Coherence of two signals at a line, 0 to 1.
    pub fn coherence(&self, line: usize, a: usize, b: usize) -> f64 {
        let s = &self.lines[line];
        let power = s[(a, a)].re * s[(b, b)].re;
        if power > 0.0 { (s[(a, b)].norm_sqr() / power).min(1.0) } else { 0.0 }
    }
}

/// Averages over overlapping segments of `segment` rows, Hann window, trend removed.
///
/// `columns` are signals of one length, sampled every `period_s`; only rows of the `stretches` are read, and no segment
/// reaches across their ends. `None` where no stretch holds a segment.
pub fn welch(columns: &[&[f64]], stretches: &[Range<usize>], segment: usize, period_s: f64, highest_hz: f64) -> Option<CrossSpectra> {
    if segment < 16 {
        return None;
    }
    let window: Vec<f64> = (0..segment).map(|i| 0.5 - 0.5 * (TAU * i as f64 / segment as f64).cos()).collect();
    let mut sum = Sum::new(columns.len(), segment, period_s, highest_hz);
    let (mut averages, mut shared) = (0.0, 0.0);
    for stretch in stretches.iter().filter(|s| s.len() >= segment) {
        let spare = stretch.len() - segment;
        let count = spare.div_ceil((segment / 2).max(1)) + 1;
        // The segments are spread evenly, so that every row of the stretch is in one.
        let starts: Vec<usize> = (0..count).map(|i| stretch.start + if count > 1 { i * spare / (count - 1) } else { 0 }).collect();
        for start in &starts {
            sum.add(columns, *start, |piece| {
                without_trend(piece);
                piece.iter_mut().zip(&window).for_each(|(x, w)| *x *= w);
            })?;
        }
        let hop = if count > 1 { spare as f64 / (count - 1) as f64 } else { segment as f64 };
        averages += independent(&window, hop.round() as usize, count);
        shared += (1.0 - hop / segment as f64).max(0.0) * count as f64;
    }
    sum.finish(Window::Hann, averages, shared)
}

/// Averages over whole periods, of `period` rows each, taken from the end of each stretch; the drift from period to period is removed.
///
/// As [`welch`]; `None` where no stretch holds a period.
pub fn by_periods(columns: &[&[f64]], stretches: &[Range<usize>], period: usize, period_s: f64, highest_hz: f64) -> Option<CrossSpectra> {
    if period < 16 {
        return None;
    }
    let mut sum = Sum::new(columns.len(), period, period_s, highest_hz);
    for stretch in stretches {
        let whole = stretch.len() / period;
        let count = whole - unsettled(columns, stretch.end - whole * period, period, whole);
        let first = stretch.end - count * period;
        // The periodic part is the same in every period: what changes from the first to the last is drift.
        let drift: Vec<f64> = columns
            .iter()
            .map(|c| {
                let mean = |p: usize| c[first + p * period..first + (p + 1) * period].iter().sum::<f64>() / period as f64;
                if count > 1 { (mean(count - 1) - mean(0)) / ((count - 1) * period) as f64 } else { 0.0 }
            })
            .collect();
        for p in 0..count {
            let mut column = 0;
            sum.add(columns, first + p * period, |piece| {
                let slope = drift[column % drift.len()];
                piece.iter_mut().enumerate().for_each(|(i, x)| *x -= slope * i as f64);
                column += 1;
            })?;
        }
    }
    let count = sum.count;
    sum.finish(Window::Periods, count as f64, 0.0)
}

/// How many periods at the beginning have not settled: their difference from the last is four times what it is later on.
fn unsettled(columns: &[&[f64]], first: usize, period: usize, count: usize) -> usize {
    let mut most = 0;
    for column in columns {
        let Some(rows) = column.get(first..first + count * period) else { continue };
        let of = |p: usize| rows[p * period..(p + 1) * period].iter();
        let last: f64 = if count > 0 { of(count - 1).sum::<f64>() / period as f64 } else { 0.0 };
        let size: f64 = if count > 0 { of(count - 1).map(|x| (x - last).powi(2)).sum() } else { 0.0 };
        // Drift is no transient: the mean of the difference does not count.
        let differences: Vec<f64> = (0..count.saturating_sub(1))
            .map(|p| {
                let mean = of(p).zip(of(count - 1)).map(|(a, b)| a - b).sum::<f64>() / period as f64;
                of(p).zip(of(count - 1)).map(|(a, b)| (a - b - mean).powi(2)).sum()
            })
            .collect();
        let mut sorted = differences.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0).max(1e-8 * size);
        // Two periods at least must be left.
        let early = differences.iter().take(count.saturating_sub(2)).take_while(|d| **d > 4.0 * usual).count();
        most = most.max(early);
    }
    most
}

struct Sum {
    fft: std::sync::Arc<dyn realfft::RealToComplex<f64>>,
    segment: usize,
    period_s: f64,
    lines: Vec<DMatrix<Complex<f64>>>,
    piece: Vec<f64>,
    spectra: Vec<Vec<Complex<f64>>>,
    count: usize,
}

impl Sum {
    fn new(columns: usize, segment: usize, period_s: f64, highest_hz: f64) -> Sum {
        let fft = RealFftPlanner::new().plan_fft_forward(segment);
        let top = (highest_hz.min(0.5 / period_s) * segment as f64 * period_s + 1e-9) as usize;
        let count = top.min(segment / 2);
        let spectra = vec![fft.make_output_vec(); columns];
        let lines = vec![DMatrix::zeros(columns, columns); count];
        Sum { piece: vec![0.0; segment], fft, segment, period_s, lines, spectra, count: 0 }
    }

    fn add(&mut self, columns: &[&[f64]], start: usize, mut prepare: impl FnMut(&mut [f64])) -> Option<()> {
        for (column, spectrum) in columns.iter().zip(&mut self.spectra) {
            self.piece.copy_from_slice(column.get(start..start + self.segment)?);
            prepare(&mut self.piece);
            self.fft.process(&mut self.piece, spectrum).ok()?;
        }
        for (k, line) in self.lines.iter_mut().enumerate() {
            for a in 0..self.spectra.len() {
                for b in 0..self.spectra.len() {
                    line[(a, b)] += self.spectra[a][k + 1] * self.spectra[b][k + 1].conj();
                }
            }
        }
        self.count += 1;
        Some(())
    }

    fn finish(mut self, window: Window, averages: f64, shared: f64) -> Option<CrossSpectra> {
        if self.count == 0 || self.lines.is_empty() {
            return None;
        }
        let resolution_hz = 1.0 / (self.segment as f64 * self.period_s);
        let share = 1.0 / self.count as f64;
        self.lines.iter_mut().for_each(|l| *l *= Complex::new(share, 0.0));
        let averaging = Averaging {
            window,
            segment_s: self.segment as f64 * self.period_s,
            overlap: shared / self.count as f64,
            segments: self.count,
            averages,
            resolution_hz,
        };
        Some(CrossSpectra { hz: (1..=self.lines.len()).map(|k| k as f64 * resolution_hz).collect(), lines: self.lines, averaging })
    }
}

/// Takes the straight line of least squares out.
pub fn without_trend(piece: &mut [f64]) {
    let n = piece.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let mean = piece.iter().sum::<f64>() / n;
    let moment: f64 = piece.iter().enumerate().map(|(i, x)| (i as f64 - middle) * x).sum();
    let slope = moment / (n * (n * n - 1.0) / 12.0).max(f64::MIN_POSITIVE);
    for (i, x) in piece.iter_mut().enumerate() {
        *x -= mean + slope * (i as f64 - middle);
    }
}

/// How many independent segments `count` overlapping ones are worth (Welch 1967).
fn independent(window: &[f64], hop: usize, count: usize) -> f64 {
    let energy: f64 = window.iter().map(|w| w * w).sum();
    let k = count as f64;
    let mut spread = 1.0;
    for lag in 1..count {
        let shift = lag * hop;
        if shift >= window.len() {
            break;
        }
        let shared: f64 = window[shift..].iter().zip(window).map(|(a, b)| a * b).sum();
        spread += 2.0 * (1.0 - lag as f64 / k) * (shared / energy).powi(2);
    }
    k / spread
}

/// Normalised autocorrelation from which a signal counts as periodic.
const PERIODIC: f64 = 0.9999;

/// Rows after which a signal repeats itself, from its autocorrelation; `None` where it does not within half its length.
pub fn repeats_after(signal: &[f64]) -> Option<usize> {
    let n = signal.len();
    let mean = signal.iter().sum::<f64>() / n.max(1) as f64;
    if n < 64 || !mean.is_finite() {
        return None;
    }
    let size = (2 * n).next_power_of_two();
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, inverse) = (planner.plan_fft_forward(size), planner.plan_fft_inverse(size));
    let mut padded = forward.make_input_vec();
    padded.iter_mut().zip(signal).for_each(|(p, x)| *p = x - mean);
    let mut spectrum = forward.make_output_vec();
    forward.process(&mut padded, &mut spectrum).ok()?;
    spectrum.iter_mut().for_each(|x| *x = Complex::new(x.norm_sqr(), 0.0));
    let mut correlation = inverse.make_output_vec();
    inverse.process(&mut spectrum, &mut correlation).ok()?;
    // Energy of the first i values.
    let mut energy = vec![0.0; n + 1];
    for (i, x) in signal.iter().enumerate() {
        energy[i + 1] = energy[i] + (x - mean).powi(2);
    }
    let mut fell = false;
    let at = |lag: usize| {
        let both = energy[n - lag] * (energy[n] - energy[lag]);
        if both > 0.0 { correlation[lag] / size as f64 / both.sqrt() } else { 0.0 }
    };
    for lag in 1..=n / 2 {
        let now = at(lag);
        fell |= now < 0.9;
        if fell && now > PERIODIC && now >= at(lag - 1) && now >= at(lag + 1) {
            return Some(lag);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// One stretch.
    fn from(start: usize, end: usize) -> Vec<Range<usize>> {
        std::iter::once(start..end).collect()
    }

    fn noise(n: usize, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()
    }

    #[test]
    fn coherence_and_averages_are_as_the_theory_has_them() {
        let (x, n) = (noise(64_000, 1), noise(64_000, 2));
        // Half the power of y is that of x.
        let y: Vec<f64> = x.iter().zip(&n).map(|(x, n)| 2.0 * x + 2.0 * n).collect();
        let s = welch(&[&x, &y], &from(0, 64_000), 1000, 1e-3, 500.0).unwrap();
        let mean = |f: &dyn Fn(usize) -> f64| (0..s.hz.len()).map(f).sum::<f64>() / s.hz.len() as f64;
        assert!((mean(&|k| s.coherence(k, 0, 1)) - 0.5).abs() < 0.02);
        // 50 % overlap of Hann windows is worth 0.947 segments each.
        assert_eq!(s.averaging.segments, 127);
        assert!((s.averaging.averages / 127.0 - 0.947).abs() < 0.003, "{:?}", s.averaging);
        // The scatter of H1 is what coherence and averages say.
        let ratio = |k: usize| s.lines[k][(1, 0)] / s.lines[k][(0, 0)];
        let spread = mean(&|k| (ratio(k) - 2.0).norm_sqr() / 4.0);
        let expected = mean(&|k| (1.0 - s.coherence(k, 0, 1)) / (s.averaging.averages * s.coherence(k, 0, 1)));
        assert!((spread / expected - 1.0).abs() < 0.2, "{spread} {expected}");
    }

    #[test]
    fn a_period_is_found_and_whole_periods_do_not_leak() {
        let one = noise(500, 3);
        let x: Vec<f64> = (0..2200).map(|i| one[i % 500]).collect();
        assert_eq!(repeats_after(&x), Some(500));
        assert_eq!(repeats_after(&noise(2200, 4)), None);
        let y: Vec<f64> = (0..2200).map(|i| one[(i + 499) % 500] + 1e-2 * i as f64).collect();
        let s = by_periods(&[&x, &y], &from(100, 2200), 500, 1e-3, 400.0).unwrap();
        assert_eq!(s.averaging.segments, 4);
        for k in 0..s.hz.len() {
            let h = s.lines[k][(1, 0)] / s.lines[k][(0, 0)];
            let exact = Complex::from_polar(1.0, -TAU * s.hz[k] * 1e-3);
            assert!((h - exact).norm() < 1e-9, "{k}: {h} {exact}");
        }
    }

    #[test]
    fn stretches_that_are_too_short_give_nothing() {
        let x = noise(300, 5);
        assert!(welch(&[&x], &from(0, 300), 400, 1e-3, 500.0).is_none());
        assert!(welch(&[&x], &[], 100, 1e-3, 500.0).is_none());
        assert!(welch(&[&x], &from(250, 600), 100, 1e-3, 500.0).is_none(), "a stretch beyond the record");
        assert!(by_periods(&[&x], &from(0, 300), 301, 1e-3, 500.0).is_none());
    }
}
