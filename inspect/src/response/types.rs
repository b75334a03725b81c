//! The response of a joint as a value.

use serde::Serialize;

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
