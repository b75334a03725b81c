//! When a loop begins to shake, found within 0.3 s: in the force on the master and its motion, as the guard watches them, but without acting.
//!
//! The part of the force above 8 Hz does not die, and it puts energy into the master (`W > 0`, see [`backdrive_control::guard`]): a hand or a touch
//! takes energy out, or its ringing dies. Looked at every 25 ms, over four windows of 50 ms or, for slow oscillations, three of 100 ms.

use backdrive_msgs::{MAX_AXES, Sample};
use std::collections::VecDeque;

/// Below this there is no vibration, Hz: as for the verdict on a run.
const CORNER_HZ: f64 = 8.0;

/// Time between two looks, s.
const HOP_S: f64 = 0.025;

/// Hops that are kept: 0.3 s.
const KEPT: usize = 12;

/// Windows: hops in each, and how many there are.
const WINDOWS: [(usize, usize); 2] = [(2, 4), (4, 3)];

/// A window has at least this share of the one before, or the oscillation dies: 0.9 in 50 ms is a time constant of half a second.
const PERSISTS: f64 = 0.9;

/// The oscillation is at least this share of the whole force.
const SHARE: f64 = 0.05;

/// Changes of sign in each window but the shortest periods, at least: a force that slides away has none.
const CROSSINGS: usize = 4;

/// A loop is calm again when the oscillation has been below this share of what it was at the onset, or of the least force, for [`CALM_S`].
const CALM: f64 = 0.3;

/// s.
const CALM_S: f64 = 0.4;

#[derive(Debug, Clone, Copy, Default)]
struct Hop {
    square: f64,
    total: f64,
    work: f64,
    crossings: usize,
    low: f64,
    high: f64,
}

#[derive(Debug, Clone, Default)]
struct Axis {
    begun: bool,
    /// Low-passed force and position, and what is above them.
    low: [f64; 2],
    fast: [f64; 2],
    is_above: bool,
    hop: Hop,
    hops: VecDeque<Hop>,
}

/// An oscillation that has begun.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Onset {
    /// The axis, from 0.
    pub axis: usize,
    /// When it was found, s since the start of the run.
    pub time_s: f64,
    /// Hz.
    pub frequency_hz: f64,
    /// Half the peak-to-peak of the master's position above 8 Hz, m or rad.
    pub amplitude: f64,
    /// RMS of the force above 8 Hz, N or N m.
    pub force: f64,
}

/// Watches the master of a run.
#[derive(Debug)]
pub(crate) struct OnsetWatch {
    period_s: f64,
    smoothing: f64,
    per_hop: usize,
    filled: usize,
    least: f64,
    axes: Vec<Axis>,
    shaking: Option<Onset>,
    calm_hops: usize,
}

impl OnsetWatch {
    /// `least`: an oscillation of the force below this RMS is left alone, N or N m.
    pub fn new(least: f64, rate_hz: f64) -> OnsetWatch {
        OnsetWatch {
            period_s: 1.0 / rate_hz,
            smoothing: 1.0 - (-2.0 * std::f64::consts::PI * CORNER_HZ / rate_hz).exp(),
            per_hop: ((HOP_S * rate_hz).round() as usize).max(2),
            filled: 0,
            least,
            axes: vec![Axis::default(); MAX_AXES],
            shaking: None,
            calm_hops: 0,
        }
    }

    /// RMS of the force above 8 Hz over the last 0.1 s, the largest of all axes, N or N m.
    pub fn level(&self) -> f64 {
        self.axes.iter().map(|a| a.rms(a.hops.len().saturating_sub(4)..a.hops.len(), self.per_hop)).fold(0.0, f64::max)
    }

    /// A sample of the master: position, and the force applied to it. The onset, once.
    pub fn take(&mut self, sample: &Sample) -> Option<Onset> {
        for (axis, state) in self.axes.iter_mut().enumerate().take(sample.len()) {
            if sample.position[axis].is_finite() && sample.effort[axis].is_finite() {
                state.take(sample.effort[axis], sample.position[axis], self.smoothing, self.least);
            }
        }
        self.filled += 1;
        if self.filled < self.per_hop {
            return None;
        }
        self.filled = 0;
        for state in &mut self.axes {
            let hop = std::mem::take(&mut state.hop);
            state.hops.push_back(hop);
            state.hops.drain(..state.hops.len().saturating_sub(KEPT));
        }
        let time_s = sample.step as f64 * self.period_s;
        match self.shaking {
            Some(onset) => {
                let calm = self.level() < (CALM * onset.force).max(0.5 * self.least);
                self.calm_hops = if calm { self.calm_hops + 1 } else { 0 };
                if self.calm_hops as f64 * HOP_S >= CALM_S {
                    (self.shaking, self.calm_hops) = (None, 0);
                }
                None
            }
            None => {
                let found = (0..sample.len()).find_map(|axis| self.onset(axis, time_s));
                self.shaking = found;
                found
            }
        }
    }

    fn onset(&self, axis: usize, time_s: f64) -> Option<Onset> {
        let state = &self.axes[axis];
        WINDOWS.iter().find_map(|(hops, count)| {
            let first = state.hops.len().checked_sub(hops * count)?;
            let window = |i: usize| first + i * hops..first + (i + 1) * hops;
            let rms: Vec<f64> = (0..*count).map(|i| state.rms(window(i), self.per_hop)).collect();
            let last = window(count - 1);
            let all = state.hops.range(first..);
            let total = (state.hops.range(last).map(|h| h.total).sum::<f64>() / (hops * self.per_hop) as f64).sqrt();
            let crossings: usize = all.clone().map(|h| h.crossings).sum();
            let persists = rms.windows(2).all(|w| w[1] >= PERSISTS * w[0]) && rms.iter().all(|r| *r > self.least);
            let active = all.clone().map(|h| h.work).sum::<f64>() > 0.0;
            let force = *rms.last()?;
            if !(persists && active && crossings >= CROSSINGS && force > SHARE * total) {
                return None;
            }
            let seconds = (hops * count * self.per_hop) as f64 * self.period_s;
            let (low, high) =
                all.rev().take(4).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h.low), high.max(h.high)));
            let frequency_hz = crossings as f64 / (2.0 * seconds);
            Some(Onset { axis, time_s, frequency_hz, amplitude: 0.5 * (high - low), force })
        })
    }
}

impl Axis {
    fn take(&mut self, force: f64, position: f64, smoothing: f64, least: f64) {
        if !self.begun {
            (self.low, self.begun) = ([force, position], true);
        }
        self.low[0] += smoothing * (force - self.low[0]);
        self.low[1] += smoothing * (position - self.low[1]);
        let fast = [force - self.low[0], position - self.low[1]];
        // The force of a sample holds until the next.
        self.hop.work += self.fast[0] * (fast[1] - self.fast[1]);
        self.hop.square += fast[0] * fast[0];
        self.hop.total += force * force;
        self.hop.low = self.hop.low.min(fast[1]);
        self.hop.high = self.hop.high.max(fast[1]);
        if fast[0].abs() > 0.5 * least && (fast[0] > 0.0) != self.is_above {
            self.is_above = !self.is_above;
            self.hop.crossings += 1;
        }
        self.fast = fast;
    }

    fn rms(&self, hops: std::ops::Range<usize>, per_hop: usize) -> f64 {
        let count = (hops.len() * per_hop).max(1) as f64;
        (self.hops.range(hops).map(|h| h.square).sum::<f64>() / count).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Drives the watch with a force of an amplitude over time at a frequency, and a master that it moves; `phase` of the force before the motion.
    fn drive(hz: f64, phase: f64, amplitude: impl Fn(f64) -> f64, seconds: f64, rate_hz: f64) -> Vec<Onset> {
        let mut watch = OnsetWatch::new(0.02, rate_hz);
        let mut found = Vec::new();
        for step in 0..(seconds * rate_hz) as u64 {
            let t = step as f64 / rate_hz;
            let w = 2.0 * std::f64::consts::PI * hz;
            let mut sample = Sample::new(1);
            sample.step = step;
            sample.effort[0] = -2.0 + amplitude(t) * (w * t + phase).sin();
            sample.position[0] = 0.005 + 1e-4 * amplitude(t) * (w * t).sin();
            found.extend(watch.take(&sample));
        }
        found
    }

    #[test]
    fn an_oscillation_is_found_within_a_third_of_a_second_with_its_frequency() {
        for rate_hz in [200.0, 1000.0, 5000.0] {
            // At fewer than eight samples a period the held force lags too far behind what the sine says to put energy in.
            for hz in [11.0, 25.0, 60.0].into_iter().filter(|hz| 8.0 * hz <= rate_hz) {
                let found = drive(hz, 0.8, |t| if t < 1.0 { 0.0 } else { 1.0 }, 3.0, rate_hz);
                let [onset] = found[..] else { panic!("{rate_hz} Hz, {hz} Hz: {found:?}") };
                assert!(onset.time_s > 1.0 && onset.time_s <= 1.35, "{rate_hz} Hz, {hz} Hz: at {} s", onset.time_s);
                assert!((onset.frequency_hz - hz).abs() < 0.35 * hz, "{hz} Hz taken for {}", onset.frequency_hz);
                assert!((onset.amplitude - 1e-4).abs() < 0.4e-4, "{}", onset.amplitude);
            }
        }
    }

    #[test]
    fn ringing_that_dies_pushing_and_an_oscillation_that_the_hand_drives_are_none() {
        for decay in [3.0, 8.0, 30.0] {
            assert!(drive(40.0, 0.8, |t| if t < 1.0 { 0.0 } else { (-decay * (t - 1.0)).exp() }, 3.0, 1000.0).is_empty(), "{decay} /s");
        }
        assert!(drive(40.0, -0.8, |_| 1.0, 3.0, 1000.0).is_empty(), "the force lags the motion: it takes energy out");
        assert!(drive(1.5, 0.8, |_| 1.0, 5.0, 1000.0).is_empty(), "no vibration");
        assert!(drive(40.0, 0.8, |_| 0.01, 3.0, 1000.0).is_empty(), "not felt");
    }

    #[test]
    fn an_onset_is_reported_once_and_again_after_calm() {
        let twice = |t: f64| if (1.0..2.0).contains(&t) || (4.0..5.0).contains(&t) { 1.0 } else { 0.0 };
        assert_eq!(drive(40.0, 0.8, twice, 6.0, 1000.0).len(), 2);
    }
}
