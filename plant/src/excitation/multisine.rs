//! Random-phase multisines.

use super::shape::Grid;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustfft::{FftPlanner, num_complex::Complex};
use std::f64::consts::TAU;

/// `sum of amplitude cos(2 pi k t/period + phase_k)` over the lines `k`.
#[derive(Debug, Clone)]
pub(super) struct Lines {
    amplitude: f64,
    period: f64,
    /// Multiple of the inverse period, and phase, rad.
    lines: Vec<(usize, f64)>,
}

/// The lines of a band on a grid, as multiples of the inverse period; from 1 on.
pub(super) fn lines_in(band: [f64; 2], period: f64, grid: Grid) -> Vec<usize> {
    // Rounding must not lose a line that lies at the end of the band.
    let first = (band[0] * period - 1e-9).ceil().max(1.0) as usize;
    let last = (band[1] * period + 1e-9).floor().max(0.0) as usize;
    (first..=last).filter(|k| grid == Grid::Full || k % 2 == 1).collect()
}

/// A number of samples, where it is whole.
pub(super) fn whole(samples: f64) -> Option<usize> {
    let nearest = samples.round();
    ((samples - nearest).abs() <= 1e-9 * nearest.max(1.0)).then_some(nearest as usize)
}

impl Lines {
    pub(super) fn new(band: [f64; 2], period: f64, grid: Grid, seed: u64, crest_rounds: u32, rms: Option<f64>, peak: Option<f64>) -> Lines {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut lines: Vec<(usize, f64)> = lines_in(band, period, grid).into_iter().map(|k| (k, rng.random_range(0.0..TAU))).collect();
        for round in 0..crest_rounds {
            lower_crest(&mut lines, round);
        }
        let amplitude = match (rms, peak) {
            (Some(rms), _) => rms * (2.0 / lines.len().max(1) as f64).sqrt(),
            (None, peak) => {
                let highest = wave(&lines).iter().fold(0.0_f64, |a, x| a.max(x.re.abs()));
                if highest > 0.0 { peak.unwrap_or(0.0) / highest } else { 0.0 }
            }
        };
        Lines { amplitude, period, lines }
    }

    /// Samples of one period, where a whole number of them fills it: one transform instead of a sum for each.
    pub(super) fn one_period(&self, rate_hz: f64) -> Option<Vec<f64>> {
        let size = whole(self.period * rate_hz).filter(|n| 2 * self.lines.last().map_or(0, |l| l.0) < *n)?;
        let mut spectrum = vec![Complex::new(0.0, 0.0); size];
        for (k, phase) in &self.lines {
            spectrum[*k] = Complex::from_polar(self.amplitude, *phase);
        }
        FftPlanner::new().plan_fft_inverse(size).process(&mut spectrum);
        Some(spectrum.iter().map(|x| x.re).collect())
    }

    /// Value at `t`, s.
    pub(super) fn at(&self, t: f64) -> f64 {
        let turn = TAU * t / self.period;
        self.amplitude * self.lines.iter().map(|(k, phase)| (*k as f64 * turn + phase).cos()).sum::<f64>()
    }
}

/// One period of unit lines, finely enough sampled to show its peaks (16 samples in the fastest line).
fn wave(lines: &[(usize, f64)]) -> Vec<Complex<f64>> {
    let size = (16 * lines.last().map_or(1, |l| l.0)).next_power_of_two();
    let mut spectrum = vec![Complex::new(0.0, 0.0); size];
    for (k, phase) in lines {
        // The real part of the inverse transform is the sum of cosines.
        spectrum[*k] = Complex::from_polar(1.0, *phase);
    }
    FftPlanner::new().plan_fft_inverse(size).process(&mut spectrum);
    spectrum
}

/// One round of clipping the wave and keeping the phases of the result (Van der Ouderaa et al. 1988).
fn lower_crest(lines: &mut [(usize, f64)], round: u32) {
    let mut wave = wave(lines);
    let highest = wave.iter().fold(0.0_f64, |a, x| a.max(x.re.abs()));
    // Little is clipped at first and less and less later on, so that the phases settle.
    let limit = highest * (1.0 - 0.3 / (1.0 + 0.02 * f64::from(round)));
    for x in &mut wave {
        *x = Complex::new(x.re.clamp(-limit, limit), 0.0);
    }
    let size = wave.len();
    FftPlanner::new().plan_fft_forward(size).process(&mut wave);
    for (k, phase) in lines {
        *phase = wave[*k].arg();
    }
}
