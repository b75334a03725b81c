//! A joint that moves at a limit of its speed while its command goes on.

use crate::numeric::{median, quantile, span};
use backdrive_signal::derivative;
use backdrive_signal::low_pass::LowPass;

/// A limit of speed that was reached.
#[derive(Debug, Clone, PartialEq)]
pub struct RateLimit {
    /// The speed, unit of the position per s.
    pub speed: f64,
    /// Share of the time at which the joint is behind that it moves at this speed.
    pub share: f64,
    /// First and last sample of the longest such stretch.
    pub rows: [usize; 2],
}

/// A joint is behind where it is off its delayed command by this share of the range.
const BEHIND: f64 = 0.08;
/// Speeds within this share of the largest are at the limit.
const PLATEAU: f64 = 0.08;
/// Share of the time behind that has to be at the limit. A linear servo's speed falls as it comes nearer: of the way to a tenth it is within 8 % of
/// the largest for less than a fifth of the time.
const SHARE: f64 = 0.55;
/// Fewest seconds behind, and stretches of them.
const LEAST_S: f64 = 0.5;
const STRETCHES: usize = 2;
/// The command's own speed differs from the limit by this share of it: else the joint is late behind a ramp.
const DIFFERS: f64 = 0.2;

/// Finds it; `lag` in samples.
pub fn find(u: &[f64], y: &[f64], lag: f64, period: f64) -> Option<RateLimit> {
    let rate = 1.0 / period;
    let speed: Vec<f64> = derivative(&LowPass::butterworth(2, (0.15 * rate).min(10.0), rate).both_ways(y), period);
    let range = span(u);
    let delay = lag.round() as usize;
    let error: Vec<f64> = (0..y.len()).map(|i| (u[i.saturating_sub(delay)] - y[i]).abs()).collect();
    let usual = median(&error);
    // Direction: it moves towards the command.
    let behind: Vec<usize> =
        (0..y.len()).filter(|i| error[*i] > (BEHIND * range).max(3.0 * usual) && speed[*i] * (u[*i] - y[*i]) > 0.0).collect();
    if (behind.len() as f64) * period < LEAST_S {
        return None;
    }
    let speeds: Vec<f64> = behind.iter().map(|i| speed[*i].abs()).collect();
    let limit = quantile(&speeds, 0.95);
    // Beside the plateau nothing may be faster, for a limit is one.
    let fastest = speed.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let at: Vec<usize> = behind.iter().copied().filter(|i| speed[*i].abs() > (1.0 - PLATEAU) * limit).collect();
    let share = at.len() as f64 / behind.len() as f64;
    let asked: Vec<f64> = derivative(u, period);
    let own: Vec<f64> = at.iter().map(|i| (asked[i.saturating_sub(delay)].abs() / limit - 1.0).abs()).collect();
    if median(&own) < DIFFERS {
        return None;
    }
    let mut stretches: Vec<[usize; 2]> = Vec::new();
    for i in &at {
        match stretches.last_mut() {
            Some(last) if *i <= last[1] + 2 => last[1] = *i,
            _ => stretches.push([*i, *i]),
        }
    }
    stretches.retain(|[from, to]| (to - from) as f64 * period > 0.06);
    let rows = stretches.iter().copied().max_by_key(|[from, to]| to - from)?;
    (share > SHARE && stretches.len() >= STRETCHES && fastest < 1.25 * limit).then_some(RateLimit { speed: limit, share, rows })
}
