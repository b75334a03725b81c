//! The recordings of a fleet: which there are, of which unit, from when, and with which model.
//!
//! A manifest is a TOML file, a folder of recordings whose folders are the units, or a LeRobot dataset whose episodes are the recordings.

mod address;
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
        let local = address::local(path)?;
        let path = local.as_path();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_address_is_a_path_and_others_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.csv"), "t,x\n0,1\n").unwrap();
        let address = format!("file://{}", folder.path().display());
        assert_eq!(Manifest::open(Path::new(&address), None).unwrap().entries.len(), 1);
        let listed = format!("[[recordings]]\nfile = \"{address}/a.csv\"\nunit = \"1\"\n[[folders]]\npath = \"s3://logs/unit-2\"\n");
        let manifest = folder.path().join("fleet.toml");
        std::fs::write(&manifest, listed).unwrap();
        let refused = Manifest::open(&manifest, None).unwrap_err().to_string();
        assert!(refused.contains("s3://logs/unit-2") && refused.contains("mount"), "{refused}");
        let refused = Manifest::open(Path::new("s3://logs"), None).unwrap_err().to_string();
        assert!(refused.contains("s3://logs: s3:// is not read"), "{refused}");
    }
}
