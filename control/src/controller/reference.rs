//! From sampled positions to what laws need: speed and acceleration of a command, speed of a measurement.

use super::Reference;
use std::f64::consts::TAU;

/// A critically damped filter of second order: it follows a command of samples, and knows how fast.
///
/// Between samples the command runs in a straight line. Held, it would be a staircase, and a filter that is read at the end of each stair
/// sees an acceleration that is not there.
#[derive(Debug, Clone)]
pub struct ReferenceFilter {
    rate: f64,
    period_s: f64,
    /// The reference, and the command that it followed.
    at: Option<(Reference, f64)>,
}

impl ReferenceFilter {
    /// With both poles at `corner_hz`, above 0, for samples `period_s` apart. It lags 2/(2 pi corner) behind a ramp.
    pub fn new(corner_hz: f64, period_s: f64) -> ReferenceFilter {
        ReferenceFilter { rate: TAU * corner_hz, period_s, at: None }
    }

    /// The next sample; the first one is where it starts, at rest. Exact for straight lines between samples.
    pub fn step(&mut self, command: f64) -> Reference {
        let at_rest = (Reference { position: command, ..Reference::default() }, command);
        let (at, before) = self.at.unwrap_or(at_rest);
        let (w, t) = (self.rate, self.period_s);
        let speed = (command - before) / t;
        // Behind a ramp by 2/w of its speed, and the remaining part of the earlier motion decays.
        let lag = 2.0 * speed / w;
        let (left, left_speed) = (at.position - before + lag, at.velocity - speed);
        let slope = left_speed + w * left;
        let decay = (-w * t).exp();
        let position = command - lag + (left + slope * t) * decay;
        let velocity = speed + (left_speed - w * slope * t) * decay;
        let now = Reference { position, velocity, acceleration: w * (w * (command - position) - 2.0 * velocity) };
        self.at = Some((now, command));
        now
    }
}

/// Differences through a low-pass of first order.
#[derive(Debug, Clone)]
pub struct Differentiator {
    rate: f64,
    before: Option<f64>,
    velocity: f64,
}

impl Differentiator {
    /// With the low-pass's corner at `corner_hz`, above 0.
    pub fn new(corner_hz: f64) -> Differentiator {
        Differentiator { rate: TAU * corner_hz, before: None, velocity: 0.0 }
    }

    /// The speed with a sample that comes `elapsed_s` (above 0) after the one before, per second of the position's unit.
    pub fn step(&mut self, position: f64, elapsed_s: f64) -> f64 {
        let before = self.before.replace(position).unwrap_or(position);
        let share = -(-self.rate * elapsed_s).exp_m1();
        self.velocity += share * ((position - before) / elapsed_s - self.velocity);
        self.velocity
    }
}
