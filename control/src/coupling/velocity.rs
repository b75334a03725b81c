//! The velocity of a position that is measured in steps.

use std::f64::consts::TAU;

/// Difference of positions behind a first-order low-pass, as a passive filter of the bilinear kind would have it.
#[derive(Debug, Clone)]
pub(super) struct Velocity {
    keep: f64,
    before: Option<f64>,
    value: f64,
}

impl Velocity {
    /// Of the corner `corner_hz`, Hz.
    pub fn new(corner_hz: f64, period_s: f64) -> Velocity {
        Velocity { keep: (-TAU * corner_hz * period_s).exp(), before: None, value: 0.0 }
    }

    /// The next position: how far it has moved since the one before, and the filtered velocity.
    pub fn step(&mut self, position: f64, period_s: f64) -> (f64, f64) {
        let moved = self.before.map_or(0.0, |before| position - before);
        self.before = Some(position);
        self.value = self.keep * self.value + (1.0 - self.keep) * moved / period_s;
        (moved, self.value)
    }
}
