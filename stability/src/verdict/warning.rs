//! What a reader of an answer has to know.

use crate::frequency::Note;
use crate::outcome::Outcome;
use crate::sensors::SensorFault;
use serde::{Serialize, Serializer};
use std::fmt;

/// A warning; its text is made from what it holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Warning {
    /// Of how the recording was read.
    Recording(String),
    /// A signal is without information, always or at times.
    Sensor(SensorFault),
    /// Of the measured frequency response.
    Frequency(Note),
    /// The gains were not recorded, and the signals do not determine them.
    GainsAreRelative,
    /// The recording itself runs away.
    RecordingGrows {
        /// 1/s.
        growth_per_s: f64,
    },
    /// Only the models say so.
    LoopNotMeasured,
    /// With other grips of the range asked about it is not stable.
    NotWithEveryGrip {
        /// mu*lambda asked about.
        gain: f64,
        /// Factors on the grip, with what happens.
        fails: Vec<(f64, Outcome)>,
    },
    /// The canceller subtracts too much at rest, in words.
    OverCancelling(String),
    /// The verdict changes with the gain more than once between these mu*lambda.
    Flickers {
        /// From here.
        lowest: f64,
        /// To here.
        highest: f64,
    },
    /// Above the stability limit it is stable again.
    ReturnsToStable {
        /// At this mu*lambda.
        gain: f64,
    },
    /// The stability limit depends on the dither's amplitude.
    AmplitudeDependent {
        /// Stability limit (mu*lambda) and the dither's RMS of each amplitude.
        edges: Vec<(f64, f64)>,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::Recording(text) | Warning::OverCancelling(text) => f.write_str(text),
            Warning::Sensor(fault) => fault.fmt(f),
            Warning::Frequency(note) => note.fmt(f),
            Warning::GainsAreRelative => {
                f.write_str("the gains of the recording are not known: every gain is in multiples of the recorded one")
            }
            Warning::RecordingGrows { growth_per_s } => {
                write!(f, "with its dither and at its own gain the recorded motion grows by {growth_per_s:.2} per second")
            }
            Warning::LoopNotMeasured => {
                f.write_str("the loop itself was not measured: this answer is from the models in the bag, which reproduce the recording")
            }
            Warning::NotWithEveryGrip { gain, fails } => {
                let fails: Vec<String> = fails.iter().map(|(scale, outcome)| format!("{scale} of the grip: {outcome}")).collect();
                write!(f, "stable with this grip, but not with all grips at mu*lambda = {gain:.3}: {}", fails.join("; "))
            }
            Warning::Flickers { lowest, highest } => {
                write!(f, "from mu*lambda = {lowest:.3} to {highest:.3} the verdict changes with the gain more than once")
            }
            Warning::ReturnsToStable { gain } => {
                write!(f, "above its stability limit the loop is stable again at mu*lambda = {gain:.3}: do not rely on it")
            }
            Warning::AmplitudeDependent { edges } => {
                let edges: Vec<String> = edges.iter().map(|(edge, rms)| format!("{edge:.3} at {rms:.3} rms")).collect();
                let edges = edges.join(", ");
                write!(
                    f,
                    "the stability limit depends on the dither's amplitude ({edges}): the loop contains friction, hysteresis or \
                    backlash"
                )
            }
        }
    }
}

/// As its text.
impl Serialize for Warning {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
