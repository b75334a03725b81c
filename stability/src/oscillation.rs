//! How large an oscillation is, at which frequency, and how fast it grows.

use realfft::RealFftPlanner;
use std::cell::RefCell;

thread_local! {
    /// Runs of a sweep have holds of the same length: a transform is planned once in a thread.
    static PLANNER: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// What oscillates in a piece of a signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillation {
    /// Half the peak-to-peak of the last quarter without its trend, in the signal's unit.
    pub amplitude: f64,
    /// Strongest line above `lowest_hz`, Hz; 0 when there is none.
    pub frequency_hz: f64,
    /// Exponential growth of the envelope, 1/s; negative when it dies.
    pub growth_per_s: f64,
    /// Amplitude in the first quarter.
    pub amplitude_before: f64,
    /// Amplitude in the third quarter.
    pub amplitude_third: f64,
    /// Growth of the envelope in the later half, 1/s.
    pub later_growth_per_s: f64,
}

/// Analyses a piece of a signal sampled every `period_s`; lines below `lowest_hz` count as motion, not as oscillation.
///
/// `None` for a piece too short for two periods of `lowest_hz`, or that is not finite.
pub fn oscillation(signal: &[f64], period_s: f64, lowest_hz: f64) -> Option<Oscillation> {
    if signal.len() < 64 || (signal.len() as f64) * period_s * lowest_hz < 2.0 || signal.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let half = half_window(signal.len(), period_s, lowest_hz);
    let fast = without_slow(signal, half);
    let quarter = fast.len() / 4;
    let frequency_hz = strongest_line(&fast, period_s, lowest_hz);
    // The moving average keeps sin(wW/2)/(wW/2) of the line, which was taken off it.
    let turned = std::f64::consts::PI * frequency_hz * (2 * half + 1) as f64 * period_s;
    let kept = if turned > 0.0 { 1.0 - turned.sin() / turned } else { 1.0 };
    let half_range = |piece: &[f64]| {
        let (low, high) = piece.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        0.5 * (high - low) / kept
    };
    Some(Oscillation {
        amplitude: half_range(&fast[fast.len() - quarter..]),
        frequency_hz,
        growth_per_s: growth(&fast, period_s, lowest_hz),
        amplitude_before: half_range(&fast[..quarter]),
        amplitude_third: half_range(&fast[2 * quarter..3 * quarter]),
        later_growth_per_s: growth(&fast[fast.len() / 2..], period_s, lowest_hz),
    })
}

/// Half the window of the moving average: one period of `lowest_hz` in all.
fn half_window(rows: usize, period_s: f64, lowest_hz: f64) -> usize {
    ((0.5 / (lowest_hz * period_s)).round() as usize).clamp(1, (rows - 1) / 4)
}

/// What of a signal is faster than `lowest_hz`; a signal too short for it has nothing faster.
pub(crate) fn without_slow_motion(signal: &[f64], period_s: f64, lowest_hz: f64) -> Vec<f64> {
    let half = half_window(signal.len().max(5), period_s, lowest_hz);
    if signal.len() > 2 * half { without_slow(signal, half) } else { Vec::new() }
}

/// The signal less its moving average, cut to where that average is whole.
fn without_slow(signal: &[f64], half: usize) -> Vec<f64> {
    let window = 2 * half + 1;
    let mut sum: f64 = signal[..window].iter().sum();
    let mut fast = Vec::with_capacity(signal.len() - 2 * half);
    for middle in half..signal.len() - half {
        fast.push(signal[middle] - sum / window as f64);
        if middle + half + 1 < signal.len() {
            sum += signal[middle + half + 1] - signal[middle - half];
        }
    }
    fast
}

fn strongest_line(fast: &[f64], period_s: f64, lowest_hz: f64) -> f64 {
    let n = fast.len();
    let padded = (4 * n).next_power_of_two();
    let hann = |i: usize| 0.5 - 0.5 * (2.0 * std::f64::consts::PI * i as f64 / n as f64).cos();
    let transform = PLANNER.with_borrow_mut(|planner| planner.plan_fft_forward(padded));
    let (mut windowed, mut bins) = (transform.make_input_vec(), transform.make_output_vec());
    windowed.iter_mut().zip(fast).enumerate().for_each(|(i, (to, x))| *to = x * hann(i));
    if transform.process(&mut windowed, &mut bins).is_err() {
        return 0.0;
    }
    let hz_per_bin = 1.0 / (padded as f64 * period_s);
    let first = ((lowest_hz / hz_per_bin).ceil() as usize).max(1);
    let power: Vec<f64> = bins[..padded / 2].iter().map(|b| b.norm_sqr()).collect();
    let Some(peak) = (first..power.len().saturating_sub(1)).max_by(|a, b| power[*a].total_cmp(&power[*b])) else { return 0.0 };
    if power[peak] <= 0.0 {
        return 0.0;
    }
    // The vertex of the parabola through three logarithms.
    let log = |i: usize| power[i].max(f64::MIN_POSITIVE).ln();
    let (before, at, after) = (log(peak - 1), log(peak), log(peak + 1));
    let curve = before - 2.0 * at + after;
    let shift = if curve < 0.0 { 0.5 * (before - after) / curve } else { 0.0 };
    (peak as f64 + shift.clamp(-0.5, 0.5)) * hz_per_bin
}

/// Slope of the logarithm of the RMS over windows of one period of `lowest_hz`, by least squares weighted towards none.
fn growth(fast: &[f64], period_s: f64, lowest_hz: f64) -> f64 {
    let window = ((1.0 / (lowest_hz * period_s)).round() as usize).clamp(8, fast.len() / 2);
    let points: Vec<(f64, f64)> = fast
        .chunks_exact(window)
        .enumerate()
        .filter_map(|(i, chunk)| {
            let rms = (chunk.iter().map(|x| x * x).sum::<f64>() / window as f64).sqrt();
            (rms > 0.0).then(|| ((i as f64 + 0.5) * window as f64 * period_s, rms.ln()))
        })
        .collect();
    slope(&points)
}

fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    if n < 2.0 {
        return 0.0;
    }
    let (mean_x, mean_y) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let (mut xy, mut xx) = (0.0, 0.0);
    for (x, y) in points {
        xy += (x - mean_x) * (y - mean_y);
        xx += (x - mean_x).powi(2);
    }
    if xx > 0.0 { xy / xx } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_growing_sine_on_a_ramp_is_measured() {
        let signal: Vec<f64> = (0..4000)
            .map(|i| {
                let t = i as f64 * 2e-4;
                1e-2 * t + 1e-4 * (3.0 * t).exp() * (2.0 * std::f64::consts::PI * 61.3 * t).sin()
            })
            .collect();
        let found = oscillation(&signal, 2e-4, 10.0).unwrap();
        assert!((found.frequency_hz - 61.3).abs() < 0.3, "{found:?}");
        assert!((found.growth_per_s - 3.0).abs() < 0.1, "{found:?}");
        assert!(found.amplitude > 5e-4 && found.amplitude < 1.2e-3, "{found:?}");
    }

    #[test]
    fn what_is_too_short_or_broken_is_refused() {
        assert_eq!(oscillation(&[0.0; 10], 1e-3, 10.0), None);
        let mut signal = vec![0.0; 1000];
        signal[500] = f64::NAN;
        assert_eq!(oscillation(&signal, 1e-3, 10.0), None);
    }
}
