//! What stands still: steady error under load, dead band, overshoot of steps.

use super::types::Interval;
use crate::joints::Joint;
use crate::numeric::{deviation, mean, median, span};
use crate::recording::Recording;
use backdrive_diagnosis::recordings::follow::student;
use backdrive_diagnosis::recordings::noise;

/// A command is held where it stays within this share of its range, for at least this number of seconds and lags.
const STILL: f64 = 2e-3;
const LEAST_S: f64 = 0.5;
const LEAST_LAGS: f64 = 3.0;
/// The last share of a hold, over which the steady position is taken.
const TAIL: f64 = 0.3;
/// A position has settled where it varies by less than this share of the command's range in the tail.
const SETTLED: f64 = 0.01;
/// A step is at least this share of the range, within this number of samples.
const STEP: f64 = 0.1;
/// Fewest holds from either side for a dead band, and fewest steps for an overshoot.
const LEAST_HOLDS: usize = 3;
const LEAST_STEPS: usize = 2;

/// What holds and steps show.
#[derive(Debug, Default)]
pub struct Steady {
    /// Median overshoot, as a share of the step.
    pub overshoot: Option<f64>,
    /// Mean and largest steady error.
    pub droop: Option<[f64; 2]>,
    /// Approached from above minus from below.
    pub dead_band: Option<Interval>,
}

/// Evaluates every hold of the command; `lag` in samples.
pub fn steady(recording: &Recording, joint: &Joint, u: &[f64], y: &[f64], lag: f64) -> Steady {
    let (range, period) = (span(u), recording.period);
    let least = ((LEAST_S / period).max(LEAST_LAGS * lag) as usize).max(8);
    let fine = noise::step_of(y).unwrap_or(0.0).max(noise::white(y).unwrap_or(0.0));
    let (mut errors, mut above, mut below, mut overshoots) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut from = 0;
    for to in 1..=u.len() {
        if to < u.len() && (u[to] - u[from]).abs() <= STILL * range {
            continue;
        }
        if to - from >= least {
            let tail = &y[to - ((to - from) as f64 * TAIL) as usize..to];
            if deviation(tail) < (SETTLED * range).max(2.0 * fine) {
                let level = mean(&u[from..to]);
                let error = mean(tail) - level;
                errors.push(error);
                // The command before the hold shows from which side it was approached.
                let before = from.checked_sub(((0.3 / period) as usize).max(2)).map(|place| u[place]);
                match before {
                    Some(before) if before > level + 4.0 * STILL * range => above.push(error),
                    Some(before) if before < level - 4.0 * STILL * range => below.push(error),
                    _ => {}
                }
                let step = from.checked_sub(2).map_or(0.0, |place| level - u[place]);
                if step.abs() > STEP * range {
                    let peak = y[from..to].iter().map(|y| step.signum() * (y - mean(tail))).fold(f64::NEG_INFINITY, f64::max);
                    overshoots.push((peak - 2.0 * fine).max(0.0) / step.abs());
                }
            }
        }
        from = to;
    }
    let largest = errors.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let droop = largest.filter(|_| errors.len() >= LEAST_HOLDS && !joint.is_led).map(|largest| [mean(&errors), largest]);
    Steady { overshoot: (overshoots.len() >= LEAST_STEPS).then(|| median(&overshoots)), droop, dead_band: dead_band(&above, &below) }
}

/// Difference of means with the interval of Welch's t.
fn dead_band(above: &[f64], below: &[f64]) -> Option<Interval> {
    if above.len().min(below.len()) < LEAST_HOLDS {
        return None;
    }
    let error = |x: &[f64]| x.iter().map(|v| (v - mean(x)).powi(2)).sum::<f64>() / ((x.len() - 1) * x.len()) as f64;
    let value = mean(above) - mean(below);
    let half = student((above.len().min(below.len()) - 1) as f64) * (error(above) + error(below)).sqrt();
    (value - half > 0.0).then_some(Interval { value, low: value - half, high: value + half })
}
