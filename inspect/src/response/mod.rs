//! Command and response of a joint: lag, bandwidth, overshoot, droop, dead band, limit of speed.

mod frequency;
mod holds;
mod rate_limit;
mod types;

use crate::joints::Joint;
use crate::numeric::{span, thinned};
use crate::recording::Recording;
use backdrive_diagnosis::recordings::follow::Profile;
use backdrive_signal::derivative;
use backdrive_signal::statistics::rms;

pub use rate_limit::RateLimit;
pub use types::{Bandwidth, Interval, Response};

/// Rate to which signals are thinned for the lag, Hz.
const THINNED_HZ: f64 = 200.0;
/// Lags that are tried, s.
const EARLY_S: f64 = 0.2;
const LATE_S: f64 = 1.0;
/// Share of variance below which a position does not follow its command, and nothing of the response is claimed.
const EXPLAINED: f64 = 0.5;
/// A command moves in a direction where it does so by this share of its usual speed.
const MOVES: f64 = 0.1;

/// The response of each joint with a command and a position that move, and at which joints a limit of speed was reached.
pub fn responses(recording: &Recording, joints: &[Joint]) -> Vec<(Response, Option<RateLimit>)> {
    joints.iter().filter_map(|joint| of_joint(recording, joint)).collect()
}

fn of_joint(recording: &Recording, joint: &Joint) -> Option<(Response, Option<RateLimit>)> {
    let (command, position) = (&recording.signals[joint.command?], &recording.signals[joint.position?]);
    let (u, y) = (&command.even, &position.even);
    if u.len() < 100 || y.len() != u.len() || span(u) == 0.0 || span(y) == 0.0 {
        return None;
    }
    let stride = ((recording.rate() / THINNED_HZ) as usize).max(1);
    let period = recording.period * stride as f64;
    let (a, b) = (thinned(u, stride), thinned(y, stride));
    let lags = (-(EARLY_S / period) as i64, (LATE_S / period) as i64);
    let profile = Profile::new(&a, &b, lags, None);
    let best = profile.best(None)?;
    if best.explained < EXPLAINED || best.gain <= 0.0 {
        return None;
    }
    let in_ms =
        |lag: f64, half: f64| Interval { value: 1e3 * lag * period, low: 1e3 * (lag - half) * period, high: 1e3 * (lag + half) * period };
    // An interval as wide as what was tried is no lag.
    let is_known = |half: &f64| half * period < 0.5 * LATE_S && !profile.is_at_the_end(&best);
    let lag_ms = profile.uncertainty().filter(is_known).map(|half| in_ms(best.lag, half));
    let lag = (best.lag * period / recording.period).max(0.0);
    let steady = holds::steady(recording, joint, u, y, lag);
    let limit = rate_limit::find(u, y, lag, recording.period);
    let times = |signal: &crate::recording::Signal| &recording.stream(signal).times;
    let steps: Vec<f64> = times(position).windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).collect();
    let rate = |signal| {
        let steps: Vec<f64> = times(signal).windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).collect();
        1.0 / crate::numeric::median(&steps).max(f64::MIN_POSITIVE)
    };
    let age = |signal| {
        let stream = recording.stream(signal);
        let ages: Vec<f64> = stream.logged.iter().zip(&stream.times).map(|(logged, stamp)| logged - stamp).collect();
        1e3 * crate::numeric::median(&ages)
    };
    let response = Response {
        file: recording.file.clone(),
        joint: joint.name.clone(),
        command: command.name.clone(),
        position: position.name.clone(),
        lag_ms,
        lag_by_direction_ms: by_direction(&a, &b, lags, period, &in_ms),
        explained: best.explained,
        bandwidth: frequency::bandwidth(u, y, recording.period),
        overshoot: steady.overshoot,
        droop: steady.droop,
        dead_band: steady.dead_band,
        rate_limit: limit.as_ref().map(|limit| limit.speed),
        jitter_ms: crate::numeric::jitter_ms(&steps),
        age_ms: (!recording.stream(position).logged.is_empty()).then(|| [age(position), age(command)]),
        rates_hz: [rate(position), rate(command)],
    };
    Some((response, limit))
}

/// Lags while the command rises and while it falls, where their intervals do not touch.
fn by_direction(u: &[f64], y: &[f64], lags: (i64, i64), period: f64, in_ms: &dyn Fn(f64, f64) -> Interval) -> Option<[Interval; 2]> {
    let rate = derivative(u, period);
    let usual = rms(&rate);
    let one = |sign: f64| {
        let keep: Vec<bool> = rate.iter().map(|v| sign * v > MOVES * usual).collect();
        let profile = Profile::new(u, y, lags, Some(&keep));
        let found = profile.best(None).filter(|found| found.explained > EXPLAINED && found.gain > 0.0)?;
        Some(in_ms(found.lag, profile.uncertainty()?))
    };
    let (rising, falling) = (one(1.0)?, one(-1.0)?);
    (rising.low > falling.high || falling.low > rising.high).then_some([rising, falling])
}
