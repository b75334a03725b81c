//! What happens to an input before it reaches its body: gain, saturation, delay, lag.

use super::segment::Segment;
use crate::model::{Input, InputKind};
use std::f64::consts::TAU;

/// An input at work.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    pub(super) slot: usize,
    /// Whether it prescribes a motion; else it is a force.
    pub(super) moves: bool,
    /// Whether it is the first force input on its place.
    pub(super) is_first: bool,
    pub(super) gain: f64,
    /// Of a motion, m.
    pub(super) offset: f64,
    saturation: f64,
    period: f64,
    /// Whole periods of the delay, and the rest of it, s.
    delay_periods: usize,
    delay_rest: f64,
    /// Segments of the last `delay_periods + 2` periods, as a ring.
    history: Vec<Segment>,
    newest: usize,
    filled: bool,
    /// Rate of the first-order lag, rad/s; infinite when there is none.
    rate: f64,
    /// Share of the lag's error that is left after a substep, and its mean over the substep.
    decay: f64,
    decay_mean: f64,
    /// Output of the lag, N.
    pub(super) lagged: f64,
}

impl Drive {
    pub(super) fn new(input: &Input, slot: usize, period: f64, substep: f64) -> Drive {
        let periods = (input.delay / period + 1e-9).floor();
        let rate = if input.kind == InputKind::Force { TAU * input.bandwidth } else { f64::INFINITY };
        let (decay, decay_mean) = if rate.is_finite() {
            let angle = rate * substep;
            ((-angle).exp(), -(-angle).exp_m1() / angle)
        } else {
            (0.0, 0.0)
        };
        Drive {
            slot,
            moves: input.kind == InputKind::Motion,
            is_first: true,
            gain: input.gain,
            offset: if input.kind == InputKind::Motion { input.offset } else { 0.0 },
            saturation: if input.kind == InputKind::Force { input.saturation } else { f64::INFINITY },
            period,
            delay_periods: periods as usize,
            delay_rest: (input.delay - periods * period).max(0.0),
            history: vec![Segment::default(); periods as usize + 2],
            newest: 0,
            filled: false,
            rate,
            decay,
            decay_mean,
            lagged: 0.0,
        }
    }

    pub(super) fn reset(&mut self) {
        self.filled = false;
        self.lagged = 0.0;
    }

    /// The segment of the period that begins now.
    pub(super) fn push(&mut self, segment: Segment) {
        if !self.filled {
            // Before the first sample a delayed input has its first value.
            self.history.fill(Segment::held(segment.c[0]));
            self.filled = true;
        }
        self.newest = if self.newest + 1 < self.history.len() { self.newest + 1 } else { 0 };
        self.history[self.newest] = segment;
    }

    #[inline]
    fn past(&self, periods: usize) -> &Segment {
        let len = self.history.len();
        // Never more periods than there are segments.
        let index = self.newest + len - periods;
        &self.history[if index < len { index } else { index - len }]
    }

    /// The delayed segment in force on `from <= s` of this period, and what to take from s. Where the delay's rest lies
    /// between, the part before it belongs to the segment before.
    #[inline]
    fn delayed(&self, before_rest: bool) -> (&Segment, f64) {
        if self.delay_rest == 0.0 && self.delay_periods == 0 {
            (&self.history[self.newest], 0.0)
        } else if before_rest {
            (self.past(self.delay_periods + 1), self.delay_rest - self.period)
        } else {
            (self.past(self.delay_periods), self.delay_rest)
        }
    }

    #[inline]
    fn limited(&self, u: f64) -> f64 {
        (self.gain * u).min(self.saturation).max(-self.saturation)
    }

    /// Integral of the force over `from..to`, in one segment, and its first moment about `centre`.
    #[inline]
    fn moments(&self, from: f64, to: f64, centre: f64) -> (f64, f64) {
        let (segment, shift) = self.delayed(from < self.delay_rest);
        if segment.is_held() {
            let impulse = self.limited(segment.c[0]) * (to - from);
            return (impulse, impulse * (0.5 * (from + to) - centre));
        }
        let middle = 0.5 * (from + to);
        // Simpson's rule is exact for a cubic; the moment needs one order less.
        let [a, b, c] = [from, middle, to].map(|s| self.limited(segment.value(s - shift)));
        let sixth = (to - from) / 6.0;
        (sixth * (a + 4.0 * b + c), sixth * (a * (from - centre) + 4.0 * b * (middle - centre) + c * (to - centre)))
    }

    /// Mean force over `from..to` of this period before the lag, N, and its slope, N/s, as the line of the same moments.
    #[inline]
    pub(super) fn line(&self, from: f64, to: f64) -> (f64, f64) {
        let (centre, length) = (0.5 * (from + to), to - from);
        let (impulse, moment) = if from < self.delay_rest && self.delay_rest < to {
            let (a, b) = (self.moments(from, self.delay_rest, centre), self.moments(self.delay_rest, to, centre));
            (a.0 + b.0, a.1 + b.1)
        } else {
            self.moments(from, to, centre)
        };
        (impulse / length, 12.0 * moment / (length * length * length))
    }

    /// Mean force over `from..to`, in one segment, N.
    #[inline]
    fn mean_in_one(&self, from: f64, to: f64) -> f64 {
        let (segment, shift) = self.delayed(from < self.delay_rest);
        if segment.is_held() {
            return self.limited(segment.c[0]);
        }
        let [a, b, c] = [from, 0.5 * (from + to), to].map(|s| self.limited(segment.value(s - shift)));
        (a + 4.0 * b + c) / 6.0
    }

    /// Mean force over the substep `from..to` behind the lag, N.
    #[inline]
    pub(super) fn mean(&mut self, from: f64, to: f64) -> f64 {
        let rest = self.delay_rest;
        let wanted = if from < rest && rest < to {
            (self.mean_in_one(from, rest) * (rest - from) + self.mean_in_one(rest, to) * (to - rest)) / (to - from)
        } else {
            self.mean_in_one(from, to)
        };
        if self.rate.is_infinite() {
            return wanted;
        }
        let error = self.lagged - wanted;
        self.lagged = wanted + error * self.decay;
        wanted + error * self.decay_mean
    }

    /// Force at `s`, seen from before, N.
    pub(super) fn force_before(&self, s: f64) -> f64 {
        if self.rate.is_finite() {
            return self.lagged;
        }
        let (segment, shift) = self.delayed(s <= self.delay_rest && self.delay_rest > 0.0);
        self.limited(segment.value(s - shift))
    }

    /// Position, velocity and acceleration that a motion input prescribes at `s`, seen from after, in m, m/s, m/s².
    #[inline]
    pub(super) fn motion(&self, s: f64) -> (f64, f64, f64) {
        let (segment, shift) = self.delayed(s < self.delay_rest);
        let s = s - shift;
        (self.gain * segment.value(s) + self.offset, self.gain * segment.slope(s), self.gain * segment.curvature(s))
    }

    /// The motion at the start of a substep (position, velocity) and at its end (with the acceleration), as [`Drive::motion`] has them.
    #[inline]
    pub(super) fn motion_over(&self, from: f64, to: f64) -> ((f64, f64), (f64, f64, f64)) {
        if self.delay_rest == 0.0 && self.delay_periods == 0 {
            let Segment { c: [c0, c1, c2, c3] } = self.history[self.newest];
            if c2 == 0.0 && c3 == 0.0 {
                let at = |s: f64| self.gain * (c0 + s * c1) + self.offset;
                let velocity = self.gain * c1;
                return ((at(from), velocity), (at(to), velocity, 0.0));
            }
        }
        let ((x0, v0, _), end) = (self.motion(from), self.motion(to));
        ((x0, v0), end)
    }

    /// Rate of the lag, rad/s, when there is one.
    pub(super) fn lag_rate(&self) -> Option<f64> {
        self.rate.is_finite().then_some(self.rate)
    }
}
