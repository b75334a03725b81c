//! One run of a model by `backdrive simulate`.

use backdrive_plant::recording::Recording;
use serde_json::Value;
use std::path::PathBuf;

/// A model run on one recording or excitation.
pub struct Run {
    /// Inputs and predicted outputs.
    pub recording: Recording,
    /// File of the prediction, which the caller may write.
    pub out: PathBuf,
    /// What a person reads of it.
    pub(crate) lines: Vec<String>,
    /// The same for programs.
    pub(crate) json: Value,
}
