//! Bandwidth from averaged spectra of command and position (Welch).

use super::types::Bandwidth;
use crate::numeric::{median, thinned};
use backdrive_stability::spectra::welch;

/// Coherence from which on a line counts: below it noise and other joints move the position.
const COHERENT: f64 = 0.7;
/// Length of a segment, s, at most; and the fewest of them in a recording.
const SEGMENT_S: f64 = 8.0;
const SEGMENTS: usize = 4;
/// Highest frequency that is evaluated, Hz: servos of joints are below it.
const HIGHEST_HZ: f64 = 60.0;
/// -3 dB.
const HALF_POWER: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Lines whose median is the size at low frequencies.
const LOW_LINES: usize = 3;

/// Where the response falls to -3 dB of its size at low frequencies; `None` where too few lines are excited.
pub fn bandwidth(u: &[f64], y: &[f64], period: f64) -> Option<Bandwidth> {
    let stride = ((0.25 / (HIGHEST_HZ * period)) as usize).max(1);
    let (u, y, period) = (thinned(u, stride), thinned(y, stride), period * stride as f64);
    let segment = ((SEGMENT_S / period) as usize).min(u.len() / SEGMENTS);
    let whole = std::iter::once(0..u.len()).collect::<Vec<_>>();
    let spectra = welch(&[&u, &y], &whole, segment, period, HIGHEST_HZ)?;
    let lines: Vec<(f64, f64)> = (0..spectra.hz.len())
        .filter(|line| spectra.coherence(*line, 0, 1) > COHERENT)
        .map(|line| {
            let s = &spectra.lines[line];
            (spectra.hz[line], s[(1, 0)].norm() / s[(0, 0)].re.max(f64::MIN_POSITIVE))
        })
        .collect();
    if lines.len() < LOW_LINES + 1 {
        return None;
    }
    let low: Vec<f64> = lines.iter().take(LOW_LINES).map(|(_, size)| *size).collect();
    let level = HALF_POWER * median(&low);
    // Two lines in a row: one alone may be off by chance.
    let below = lines.windows(2).position(|w| w[0].1 < level && w[1].1 < level);
    match below {
        Some(0) | None => Some(Bandwidth { hz: lines.last()?.0, at_least: true }),
        Some(place) => {
            let ((a, high), (b, low)) = (lines[place - 1], lines[place]);
            let share = if high > low { ((high - level) / (high - low)).clamp(0.0, 1.0) } else { 1.0 };
            Some(Bandwidth { hz: a + share * (b - a), at_least: false })
        }
    }
}
