//! The key of an answer: everything that it depends on, as SHA-256.

use crate::error::FleetError;
use crate::manifest::{Content, Entry, Loaded, Manifest};
use crate::what::What;
use backdrive_plant::model::Model;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The version of the program; answers of another version are computed again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Version(pub String);

/// Keys of the answers to one question about the recordings of a manifest.
pub struct Keys {
    question: String,
    models: BTreeMap<PathBuf, String>,
}

impl Keys {
    /// Reads the models that the manifest names.
    ///
    /// # Errors
    /// A model or the file of roles cannot be read.
    pub fn of(manifest: &Manifest, what: What, version: &Version) -> Result<Keys, FleetError> {
        let mut models = BTreeMap::new();
        for path in manifest.entries.iter().filter_map(|entry| entry.model.as_ref()) {
            if !models.contains_key(path) {
                // With the robot's files and its networks, so that a change of any of them counts.
                let model = Model::load(path).map_err(FleetError::input)?;
                models.insert(path.clone(), hex(&[model.to_toml().as_bytes()]));
            }
        }
        let roles = match &manifest.roles {
            Some(path) => std::fs::read(path).map_err(|e| FleetError::input(format!("{}: cannot be read: {e}", path.display())))?,
            None => Vec::new(),
        };
        let question = hex(&[version.0.as_bytes(), what.name().as_bytes(), manifest.settings.as_bytes(), &roles]);
        Ok(Keys { question, models })
    }

    /// The question, for pointers: version, what is asked, settings; and the model of a recording.
    pub fn question(&self, entry: &Entry) -> String {
        let model = entry.model.as_ref().and_then(|path| self.models.get(path)).map_or("", String::as_str);
        format!("{} {model}", self.question)
    }

    /// The key of a recording's answer.
    ///
    /// # Errors
    /// The recording cannot be read.
    pub fn key(&self, entry: &Entry, loaded: &Loaded) -> Result<String, FleetError> {
        let content = match &loaded.content {
            Content::File(path) => of_file(path)?,
            Content::Bytes(bytes) => hex(&[bytes]),
        };
        // Rules of reading follow the ending.
        let ending = Path::new(&entry.name).extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        Ok(short(&[self.question(entry).as_bytes(), ending.as_bytes(), content.as_bytes()]))
    }
}

/// The first 32 digits, for names of files: 128 bits.
pub(super) fn short(parts: &[&[u8]]) -> String {
    hex(parts)[..32].to_string()
}

fn hex(parts: &[&[u8]]) -> String {
    let mut hash = Sha256::new();
    for part in parts {
        // With the lengths, so that no two lists of parts are the same bytes.
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

fn of_file(path: &Path) -> Result<String, FleetError> {
    let failed = |e: std::io::Error| FleetError::input(format!("{}: cannot be read: {e}", path.display()));
    let mut file = std::fs::File::open(path).map_err(failed)?;
    let mut hash = Sha256::new();
    let mut part = vec![0; 1 << 18];
    loop {
        match file.read(&mut part).map_err(failed)? {
            0 => return Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()),
            count => hash.update(&part[..count]),
        }
    }
}
