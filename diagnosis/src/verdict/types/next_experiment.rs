//! What to record next.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What to record next, or why no recording would tell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum NextExperiment {
    /// An excitation that would tell.
    Planned(Planned),
    /// None would.
    Refused(Refused),
}

impl NextExperiment {
    /// In one sentence.
    pub fn sentence(&self) -> &str {
        match self {
            NextExperiment::Planned(planned) => &planned.sentence,
            NextExperiment::Refused(refused) => &refused.sentence,
        }
    }

    /// Name of its excitation file; `None` where there is no excitation.
    pub fn file(&self) -> Option<&str> {
        match self {
            NextExperiment::Planned(planned) => Some(&planned.file),
            NextExperiment::Refused(_) => None,
        }
    }
}

/// An excitation that would tell explanations apart, or determine parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Planned {
    /// The excitation file, beside the verdict.
    pub file: String,
    /// The input that it drives.
    pub input: String,
    /// The excitation on one line, as command lines and graphs have it.
    pub excitation: String,
    /// What to play, and what would be seen.
    pub sentence: String,
    /// The explanations that it separates, or the parameters that it determines.
    pub between: Vec<String>,
    /// How far apart it brings the two explanations that it separates least, each refitted to it, in standard deviations.
    pub separation_sd: Option<f64>,
    /// Root mean square of that difference, in standard deviations of the sensor noise.
    pub level_floors: Option<f64>,
    /// The output in which most of it shows; of a sensor that has to be added, the body or the element that it is on.
    pub output: String,
    /// How often it has to be played.
    pub repeats: u32,
    /// Length of one playing, s.
    pub duration_s: Option<f64>,
    /// Sampling rate that it was planned for, Hz.
    pub rate_hz: f64,
    /// A sensor that must be added, because no excitation is sufficient with the present ones. Absent if none is needed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor: Option<Box<Sensor>>,
    /// A known mass that an arm has to carry for it. Only in files where one is asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub payload: Option<Box<PlannedPayload>>,
}

/// A known mass on a link of an arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlannedPayload {
    /// kg.
    pub mass_kg: f64,
    /// Where its centre is in the frame of the link, m.
    pub at_m: [f64; 3],
    /// The link that it is fastened to.
    pub link: String,
}

/// A sensor that the device does not have, as an output of a model file has it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Sensor {
    /// Its kind: `position`, `velocity`, `force`.
    pub kind: String,
    /// The body that it is on, of a motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub of: Option<String>,
    /// The element whose force it reads.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<String>,
    /// The noise with which the separation was computed, standard deviation, SI unit.
    pub noise_sd: f64,
}

/// Why no excitation would tell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Refused {
    /// Why, and what would help.
    pub sentence: String,
}
