//! Motion of a joint, and how far beyond its noise it moves.

use crate::joints::Joint;
use crate::numeric::span;
use crate::recording::{Recording, Signal};
use backdrive_diagnosis::recordings::kinematics::Band;

/// The band of a recording.
pub fn band_of(recording: &Recording) -> Band {
    Band::of(recording.period, recording.rate())
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
