//! Motion of a joint: filtered alike, thinned alike, so that signals can be compared.

use crate::joints::Joint;
use crate::numeric::{span, thinned};
use crate::recording::{Recording, Signal};
use backdrive_diagnosis::low_pass::{LowPass, derivative};

/// Highest corner of the filter, Hz: what joints of arms do is below it, what encoders and converters add is mostly above.
const CORNER_HZ: f64 = 8.0;
/// The corner lies at this share of the rate at most.
const OF_RATE: f64 = 0.12;
/// Rate to which filtered signals are thinned, Hz; a lag is found between its samples.
const THINNED_HZ: f64 = 200.0;

/// A way to filter and thin.
pub struct Band {
    filter: LowPass,
    stride: usize,
    /// Step of the thinned signals, s.
    pub period: f64,
    full: f64,
}

impl Band {
    /// That of a recording.
    pub fn of(recording: &Recording) -> Band {
        Band::up_to(recording, CORNER_HZ)
    }

    /// With another corner, Hz.
    pub fn up_to(recording: &Recording, corner: f64) -> Band {
        let rate = recording.rate();
        let stride = ((rate / THINNED_HZ) as usize).max(1);
        let filter = LowPass::butterworth(2, corner.min(OF_RATE * rate), rate);
        Band { filter, stride, period: recording.period * stride as f64, full: recording.period }
    }

    /// A signal low-passed, without delay, and thinned.
    pub fn smooth(&self, values: &[f64]) -> Vec<f64> {
        thinned(&self.filter.both_ways(values), self.stride)
    }

    /// Its derivative, low-passed and thinned alike.
    pub fn rate(&self, values: &[f64]) -> Vec<f64> {
        thinned(&self.filter.both_ways(&derivative(values, self.full)), self.stride)
    }

    /// Samples of a time.
    pub fn samples(&self, seconds: f64) -> i64 {
        (seconds / self.period).round() as i64
    }
}

/// The even samples of a joint's signal; `None` where they say nothing.
pub fn of(recording: &Recording, place: Option<usize>) -> Option<&Signal> {
    place.map(|place| &recording.signals[place]).filter(|signal| signal.even.len() >= 100)
}

/// How often its noise and its step a signal moves; 0 where it does not.
pub fn excitation(signal: &Signal) -> f64 {
    let whole = span(&signal.even);
    let noise = signal.noise.max(signal.step).max(1e-9 * whole);
    if whole > 0.0 { whole / noise } else { 0.0 }
}

/// The joint's name for sentences.
pub fn title(joint: &Joint) -> String {
    if joint.name.is_empty() { "the joint".to_string() } else { format!("joint {}", joint.name) }
}
