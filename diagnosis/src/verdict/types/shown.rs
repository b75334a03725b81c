//! Where a residual shows.

use crate::locate::Character;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// When, at which frequencies and in which state a residual is largest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Where {
    /// Spans of time in the recording in which it is largest, s from its first sample; of a sensor fault every one, at most 20.
    #[serde(default)]
    pub time: Vec<[f64; 2]>,
    /// Frequencies between which the middle eight tenths of its energy lie, Hz.
    pub band_hz: [f64; 2],
    /// The state of the device in which it shows, in words, such as `reversals of the velocity across drum-ground`; null where none is known.
    pub state: Option<String>,
    /// Of an unexplained residual the kind of force it is, at the place that explains most; null where nothing moves there. Not in other files.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "stated")]
    #[schemars(with = "Option<Character>")]
    pub class: Option<Option<Character>>,
}

/// A key that is there, be its value null.
fn stated<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<Option<Character>>, D::Error> {
    Option::deserialize(deserializer).map(Some)
}
