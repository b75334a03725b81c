//! Sinusoids that go on in a signal that does much else: the harmonic F test of multitaper spectra (Thomson, Proc. IEEE 70, 1982, 1055), with the
//! sine tapers of Riedel and Sidorenko (1995), piece by piece. A line that is no stronger than all that moves within 3 Hz of it is not seen.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::PI;

/// A sinusoid that goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub(super) frequency_hz: f64,
    /// In the signal's unit, in the last piece in which it is seen.
    pub(super) amplitude: f64,
    /// Growth of its amplitude, 1/s.
    pub(super) growth_per_s: f64,
}

/// Length of a piece, s; each has half of the one before.
const PIECE_S: f64 = 1.0;
/// Tapers.
const TAPERS: usize = 6;
/// A line continues where it is seen in this number of consecutive pieces: two seconds and a half.
const IN_A_ROW: usize = 4;
/// Chance that a piece without a line shows one, over all of its frequencies.
const CHANCE: f64 = 0.05;
/// It may wander so far from piece to piece, Hz: the resolution of a piece.
pub(super) const WANDERS_HZ: f64 = 2.0;

/// The strongest line above a frequency, Hz, whose amplitude is above a floor.
pub(super) fn line(signal: &[f64], period_s: f64, above_hz: f64, floor: f64) -> Option<Line> {
    let rows = (PIECE_S / period_s) as usize;
    let pieces: Vec<Vec<(f64, f64)>> = (0..)
        .map(|i| i * rows / 2)
        .map_while(|from| signal.get(from..from + rows))
        .map(|piece| lines_of(piece, period_s, above_hz, floor))
        .collect();
    let mut best: Option<Line> = None;
    for (start, first) in pieces.iter().enumerate() {
        for (hz, amplitude) in first {
            let (mut at, mut seen) = (*hz, vec![*amplitude]);
            for next in pieces.iter().skip(start + 1) {
                let nearest = next.iter().min_by(|a, b| (a.0 - at).abs().total_cmp(&(b.0 - at).abs()));
                let Some(found) = nearest.filter(|n| (n.0 - at).abs() <= WANDERS_HZ) else { break };
                at = found.0;
                seen.push(found.1);
            }
            let (Some(before), Some(last)) = (seen.first(), seen.last()) else { continue };
            if seen.len() >= IN_A_ROW && best.is_none_or(|b| *last > b.amplitude) {
                let time = 0.5 * PIECE_S * (seen.len() - 1) as f64;
                best = Some(Line { frequency_hz: at, amplitude: *last, growth_per_s: (last / before).ln() / time });
            }
        }
    }
    best
}

/// Frequency and amplitude of every line of a piece.
fn lines_of(piece: &[f64], period_s: f64, above_hz: f64, floor: f64) -> Vec<(f64, f64)> {
    // Differences, so that the slow motion does not leak over everything.
    let steps: Vec<f64> = piece.windows(2).filter_map(|w| Some(w.get(1)? - w.first()?)).collect();
    let n = steps.len();
    let padded = (2 * n).next_power_of_two();
    let transform = FftPlanner::new().plan_fft_forward(padded);
    let taper = |k: usize, i: usize| (2.0 / (n as f64 + 1.0)).sqrt() * (PI * (k + 1) as f64 * (i + 1) as f64 / (n as f64 + 1.0)).sin();
    let mut spectra = Vec::with_capacity(TAPERS);
    let mut sums = Vec::with_capacity(TAPERS);
    for k in 0..TAPERS {
        let mut bins: Vec<Complex<f64>> = (0..padded).map(|i| Complex::new(steps.get(i).map_or(0.0, |x| x * taper(k, i)), 0.0)).collect();
        transform.process(&mut bins);
        spectra.push(bins);
        sums.push((0..n).map(|i| taper(k, i)).sum::<f64>());
    }
    let whole: f64 = sums.iter().map(|u| u * u).sum();
    let hz = |bin: usize| bin as f64 / (padded as f64 * period_s);
    let bins: Vec<usize> = (1..padded / 2).filter(|b| hz(*b) >= above_hz && hz(*b) <= 0.45 / period_s).collect();
    // Independent frequencies are as far apart as one over the piece.
    let independent = (bins.len() * n / padded).max(1) as f64;
    let freedom = 2.0 * (TAPERS as f64 - 1.0);
    let at = |k: usize, bin: usize| spectra.get(k).and_then(|s| s.get(bin)).copied().unwrap_or_default();
    let tested = |bin: usize| {
        let mean: Complex<f64> = sums.iter().enumerate().map(|(k, u)| at(k, bin) * *u).sum::<Complex<f64>>() / whole;
        let left: f64 = sums.iter().enumerate().map(|(k, u)| (at(k, bin) - mean * *u).norm_sqr()).sum();
        let f = 0.5 * freedom * mean.norm_sqr() * whole / left.max(f64::MIN_POSITIVE);
        // Differences weaken a line of the positions.
        let weaker = 2.0 * (PI * hz(bin) * period_s).sin();
        ((1.0 + 2.0 * f / freedom).powf(-0.5 * freedom), 2.0 * mean.norm() / weaker)
    };
    let all: Vec<(usize, f64, f64)> =
        bins.iter().map(|bin| (*bin, tested(*bin))).map(|(bin, (chance, amplitude))| (bin, chance, amplitude)).collect();
    let sure = all.iter().filter(|(_, chance, amplitude)| *chance < CHANCE / independent && *amplitude > floor);
    sure.map(|(bin, _, amplitude)| (hz(*bin), *amplitude)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn noisy(hz: f64, amplitude: f64, seed: u64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut slow = 0.0;
        let mut sample = move |i: i32| {
            let t = f64::from(i) * 5e-4;
            let white: f64 = StandardNormal.sample(&mut random);
            slow += 0.02 * (2e-3 * white - slow);
            0.05 * (9.0 * t).sin() + slow + amplitude * (2.0 * PI * hz * t).sin()
        };
        (0..10_000).map(&mut sample).collect()
    }

    #[test]
    fn a_line_is_found_in_coloured_noise_and_none_where_there_is_none() {
        for hz in [12.0, 40.0, 200.0] {
            let found = line(&noisy(hz, 1e-3, 3), 5e-4, 8.0, 1e-5).unwrap();
            assert!(
                (found.frequency_hz - hz).abs() < 1.0 && (found.amplitude / 1e-3 - 1.0).abs() < 0.2 && found.growth_per_s.abs() < 0.2,
                "{found:?}"
            );
        }
        for seed in 0..20 {
            assert_eq!(line(&noisy(1.0, 0.0, seed), 5e-4, 8.0, 1e-5), None);
        }
        let short: Vec<f64> = noisy(40.0, 1e-3, 3).into_iter().take(3000).collect();
        assert_eq!(line(&short, 5e-4, 8.0, 1e-5), None);
    }
}
