//! Command and response of a joint: lag, bandwidth, overshoot, droop, dead band, limit of speed.

mod frequency;
mod holds;
mod rate_limit;

use crate::joints::Joint;
use crate::numeric::{Profile, span, thinned};
use crate::recording::Recording;
use backdrive_diagnosis::low_pass::derivative;
use serde::Serialize;

pub use rate_limit::RateLimit;

/// A number with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// The estimate.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A bandwidth as far as the motion shows it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bandwidth {
    /// Where the response falls to -3 dB; where it does not, the highest frequency at which it was seen, Hz.
    pub hz: f64,
    /// Whether it is only known to be at least that.
    pub at_least: bool,
}

/// How a joint answers its command. What the motion does not show is `None`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Response {
    /// The recording.
    pub file: String,
    /// The joint; empty where it has no name.
    pub joint: String,
    /// Command, or the position of its leader.
    pub command: String,
    /// Position.
    pub position: String,
    /// By how much the position is late, ms. It is that of this motion: where the response is no pure delay, slower motion has another one.
    pub lag_ms: Option<Interval>,
    /// The same while the command rises, and while it falls, where the two intervals do not touch.
    pub lag_by_direction_ms: Option<[Interval; 2]>,
    /// Share of the motion that the command explains at this lag, 0 to 1.
    pub explained: f64,
    /// -3 dB of the response.
    pub bandwidth: Option<Bandwidth>,
    /// Median overshoot of steps, as a share of the step.
    pub overshoot: Option<f64>,
    /// Mean and largest steady error under load while the command is held, in the position's SI unit.
    pub droop: Option<[f64; 2]>,
    /// Width of the dead band: steady position approached from above minus from below, in the position's SI unit.
    pub dead_band: Option<Interval>,
    /// Limit of the joint's speed, in the position's SI unit per s.
    pub rate_limit: Option<f64>,
    /// Standard deviation of the steps of the position's stream, ms.
    pub jitter_ms: f64,
    /// Of a bag: how old the position and the command are when they are logged, median, ms.
    pub age_ms: Option<[f64; 2]>,
    /// Rate of the position's stream and, of a bag, of the command's, Hz.
    pub rates_hz: [f64; 2],
}

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
    let lag_ms = profile.uncertainty().filter(|_| !profile.is_at_the_end(&best)).map(|half| in_ms(best.lag, half));
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
        jitter_ms: 1e3 * crate::numeric::deviation(&steps),
        age_ms: (!recording.stream(position).logged.is_empty()).then(|| [age(position), age(command)]),
        rates_hz: [rate(position), rate(command)],
    };
    Some((response, limit))
}

/// Lags while the command rises and while it falls, where their intervals do not touch.
fn by_direction(u: &[f64], y: &[f64], lags: (i64, i64), period: f64, in_ms: &dyn Fn(f64, f64) -> Interval) -> Option<[Interval; 2]> {
    let rate = derivative(u, period);
    let usual = (rate.iter().map(|v| v * v).sum::<f64>() / rate.len().max(1) as f64).sqrt();
    let one = |sign: f64| {
        let keep: Vec<bool> = rate.iter().map(|v| sign * v > MOVES * usual).collect();
        let profile = Profile::new(u, y, lags, Some(&keep));
        let found = profile.best(None).filter(|found| found.explained > EXPLAINED && found.gain > 0.0)?;
        Some(in_ms(found.lag, profile.uncertainty()?))
    };
    let (rising, falling) = (one(1.0)?, one(-1.0)?);
    (rising.low > falling.high || falling.low > rising.high).then_some([rising, falling])
}
