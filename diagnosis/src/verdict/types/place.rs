//! A place as verdict files have it.

use crate::hypothesis::Place;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where an effect acts.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Place", rename_all = "snake_case")]
#[allow(dead_code)] // its variants are only read and written
pub(super) enum PlaceInFile {
    /// Two bodies, or a body and `ground`.
    Between(String, String),
    /// An input or an output of the model.
    Signal(String),
}
