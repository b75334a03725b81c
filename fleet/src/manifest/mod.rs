//! The recordings of a fleet: which there are, of which unit, from when, and with which model.
//!
//! A manifest is a TOML file, a folder of recordings whose folders are the units, or a LeRobot dataset whose episodes are the recordings.

mod file;
mod folder;
mod types;

pub use types::{Content, Entry, Loaded, Manifest, Source};

use crate::error::FleetError;
use std::path::Path;

impl Manifest {
    /// Opens a manifest, a folder, or a dataset. `model` is that of recordings for which the manifest names none.
    ///
    /// # Errors
    /// A file or folder is missing or wrong, two recordings have one name, or there is none.
    pub fn open(path: &Path, model: Option<&Path>) -> Result<Manifest, FleetError> {
        let own = path.join("fleet.toml");
        let mut manifest = match path.is_dir() {
            true if own.is_file() => file::open(&own)?,
            true => folder::open(path)?,
            false => file::open(path)?,
        };
        for entry in &mut manifest.entries {
            if let (None, Some(model)) = (&entry.model, model) {
                entry.model = Some(model.to_path_buf());
            }
        }
        manifest.entries.sort_by(|a, b| a.name.cmp(&b.name));
        if let Some(pair) = manifest.entries.windows(2).find(|pair| pair[0].name == pair[1].name) {
            return Err(FleetError::input(format!("{}: {} is listed twice; list each recording once", path.display(), pair[0].name)));
        }
        match manifest.entries.is_empty() {
            true => Err(FleetError::input(format!("{}: lists no recordings", path.display()))),
            false => Ok(manifest),
        }
    }
}
