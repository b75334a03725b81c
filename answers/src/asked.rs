//! What a diagnosis is asked.

use backdrive_diagnosis::options::Options;
use backdrive_sets::Recordings;
use std::path::PathBuf;

/// What a diagnosis is asked, by whichever caller.
#[derive(Debug, Clone, Default)]
pub struct Asked {
    /// The recordings.
    pub set: Recordings,
    /// The nominal model; without it the set's own.
    pub model: Option<PathBuf>,
    /// The grip that holds the nominal model; `none` for no hand.
    pub grip: Option<PathBuf>,
    /// Recorded signals that are not used.
    pub ignore_signal: Vec<String>,
    /// How to search.
    pub options: Options,
}
