//! Inputs between samples: holds, limits, dead time and lag.

use crate::network::{Hold, Input, InputKind};
use std::collections::VecDeque;
use std::f64::consts::PI;

/// An input over one sampling period.
#[derive(Debug, Clone, Copy, Default)]
struct Segment {
    from: f64,
    to: f64,
    slope_from: f64,
    slope_to: f64,
}

impl Segment {
    fn constant(value: f64) -> Segment {
        Segment { from: value, to: value, slope_from: 0.0, slope_to: 0.0 }
    }

    /// Value at a share of the period, by the cubic through both ends and slopes.
    fn value(&self, share: f64, period: f64) -> f64 {
        let (s, rest) = (share, 1.0 - share);
        let ends = self.from * rest * rest * (1.0 + 2.0 * s) + self.to * s * s * (3.0 - 2.0 * s);
        ends + period * s * rest * (self.slope_from * rest - self.slope_to * s)
    }

    /// Its derivative with time.
    fn slope(&self, share: f64, period: f64) -> f64 {
        let (s, rest) = (share, 1.0 - share);
        6.0 * s * rest * (self.to - self.from) / period + self.slope_from * rest * (1.0 - 3.0 * s) + self.slope_to * s * (3.0 * s - 2.0)
    }
}

/// One input as the device receives it.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    input: Input,
    period: f64,
    /// The periods that the dead time still reaches, the current one last.
    past: VecDeque<Segment>,
    last: f64,
    before: f64,
    /// State of the lag.
    lagged: f64,
}

impl Drive {
    pub fn new(input: &Input, period: f64) -> Drive {
        let kept = (input.delay / period).ceil() as usize + 2;
        Drive { input: input.clone(), period, past: vec![Segment::default(); kept].into(), last: 0.0, before: 0.0, lagged: 0.0 }
    }

    pub fn is_motion(&self) -> bool {
        self.input.kind == InputKind::Motion
    }

    pub fn body(&self) -> usize {
        self.input.on
    }

    /// As if the input had stood at this sample for ever; a force has not yet acted.
    pub fn start(&mut self, sample: f64) {
        if self.is_motion() {
            let value = self.input.gain * sample;
            self.past.iter_mut().for_each(|segment| *segment = Segment::constant(value));
            (self.last, self.before) = (value, value);
        }
    }

    /// Begins a period: the sample holds through it (zero hold), or is where the period ends.
    pub fn begin(&mut self, sample: f64) {
        let value = (self.input.gain * sample).clamp(-self.input.saturation, self.input.saturation);
        let segment = match self.input.hold {
            Hold::Zero => Segment::constant(value),
            Hold::Linear => {
                let slope = (value - self.last) / self.period;
                Segment { from: self.last, to: value, slope_from: slope, slope_to: slope }
            }
            Hold::Cubic => {
                // Slope at the end from this and the last two samples, second order; the next period goes on with it.
                let slope_to = (3.0 * value - 4.0 * self.last + self.before) / (2.0 * self.period);
                Segment { from: self.last, to: value, slope_from: self.past.back().map_or(0.0, |last| last.slope_to), slope_to }
            }
        };
        (self.before, self.last) = (self.last, value);
        self.past.pop_front();
        self.past.push_back(segment);
    }

    /// Position (m) of a moved body at a share of the period.
    pub fn position(&self, share: f64) -> f64 {
        self.past.back().map_or(0.0, |segment| segment.value(share, self.period))
    }

    /// Speed (m/s) of a moved body at a share of the period.
    pub fn speed(&self, share: f64) -> f64 {
        self.past.back().map_or(0.0, |segment| segment.slope(share, self.period))
    }

    /// Acceleration (m/s2) of a moved body at the end of the period, over its last `share`.
    pub fn acceleration(&self, share: f64) -> f64 {
        // The slope is at most quadratic in the share, so this one-sided difference is exact.
        let at = |s: f64| self.speed(s);
        (3.0 * at(1.0) - 4.0 * at(1.0 - 0.5 * share) + at(1.0 - share)) / (share * self.period)
    }

    /// Mean force (N) over the part of the period from `from` to `to` (s), dead time and lag included. Carries the lag on.
    pub fn mean_force(&mut self, from: f64, to: f64) -> f64 {
        let arrived = self.mean(from - self.input.delay, to - self.input.delay);
        if self.input.bandwidth.is_infinite() {
            return arrived;
        }
        // y' = w (u - y) with u held at its mean: exact, and so is the mean of y.
        let turns = 2.0 * PI * self.input.bandwidth * (to - from);
        let away = self.lagged - arrived;
        self.lagged = arrived + away * (-turns).exp();
        arrived - away * (-turns).exp_m1() / turns
    }

    /// Force (N) at the end of the period.
    pub fn force_now(&self) -> f64 {
        if self.input.bandwidth.is_finite() {
            return self.lagged;
        }
        // A zero hold jumps at the end; what acted until then is meant.
        let end = self.period * (1.0 - 1e-9) - self.input.delay;
        self.mean(end - 1e-9 * self.period, end)
    }

    /// Mean over a stretch of time, s from the beginning of the current period; jumps between samples are met exactly.
    fn mean(&self, from: f64, to: f64) -> f64 {
        let newest = self.past.len() as i64 - 1;
        let first = (from / self.period).floor() as i64;
        let last = ((to / self.period).floor() as i64).max(first);
        let mut sum = 0.0;
        for period in first..=last {
            let begin = period as f64 * self.period;
            let (a, b) = (from.max(begin), to.min(begin + self.period));
            if b > a {
                let segment = &self.past[(newest + period).clamp(0, newest) as usize];
                sum += (b - a) * segment.value((0.5 * (a + b) - begin) / self.period, self.period);
            }
        }
        sum / (to - from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(hold: Hold, kind: InputKind) -> Input {
        let none = f64::INFINITY;
        Input { name: "u".into(), kind, on: 0, hold, gain: 1.0, saturation: none, delay: 0.0, bandwidth: none, back_emf: 0.0 }
    }

    #[test]
    fn dead_time_meets_the_edge_inside_a_stretch() {
        let mut drive = Drive::new(&Input { delay: 0.25e-3, ..input(Hold::Zero, InputKind::Force) }, 1e-3);
        drive.begin(2.0);
        assert_eq!(drive.mean_force(0.0, 0.25e-3), 0.0);
        assert!((drive.mean_force(0.2e-3, 0.3e-3) - 1.0).abs() < 1e-12);
        drive.begin(6.0);
        assert!((drive.mean_force(0.0, 0.5e-3) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn the_lag_answers_a_step_as_it_should() {
        let mut drive = Drive::new(&Input { bandwidth: 100.0, ..input(Hold::Zero, InputKind::Force) }, 1e-3);
        drive.begin(1.0);
        let parts = 7;
        let mean: f64 = (0..parts).map(|i| drive.mean_force(1e-3 * i as f64 / 7.0, 1e-3 * (i + 1) as f64 / 7.0) / 7.0).sum();
        let w = 2.0 * PI * 100.0 * 1e-3;
        assert!((drive.lagged - (1.0 - (-w).exp())).abs() < 1e-12);
        assert!((mean - (1.0 - (1.0 - (-w).exp()) / w)).abs() < 1e-12);
    }

    #[test]
    fn a_cubic_follows_a_parabola() {
        let mut drive = Drive::new(&input(Hold::Cubic, InputKind::Motion), 0.1);
        let at = |t: f64| 3.0 * t * t;
        for k in 1..=5 {
            drive.begin(at(0.1 * k as f64));
        }
        assert!((drive.position(0.3) - at(0.43)).abs() < 1e-12);
        assert!((drive.speed(0.3) - 6.0 * 0.43).abs() < 1e-12);
        assert!((drive.acceleration(0.01) - 6.0).abs() < 1e-8);
    }
}
