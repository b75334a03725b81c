//! The folder with answers, and its files.

use super::key::short;
use crate::answered::Answered;
use crate::error::FleetError;
use crate::manifest::Entry;
use backdrive_bags::move_into_place;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A folder with answers.
#[derive(Debug, Clone)]
pub struct Store {
    folder: PathBuf,
}

/// What points from a recording to its answer.
#[derive(Debug, Serialize, Deserialize)]
struct Pointer {
    recording: String,
    key: String,
}

impl Store {
    /// Opens a folder; it is made where it is not there.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn open(folder: &Path) -> Result<Store, FleetError> {
        for below in ["answers", "verdicts", "done"] {
            let path = folder.join(below);
            std::fs::create_dir_all(&path).map_err(|e| FleetError::file(&path, format!("cannot be made: {e}")))?;
        }
        Ok(Store { folder: folder.to_path_buf() })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The answer with this key, where there is one. A file that cannot be read counts as none.
    pub fn answer(&self, key: &str) -> Option<Answered> {
        let mut answered: Answered = serde_json::from_slice(&std::fs::read(self.answer_file(key)).ok()?).ok()?;
        // The verdict is a file of its own, which no table needs.
        answered.verdict = Value::Null;
        Some(answered)
    }

    /// Keeps an answer: the verdict first, then the rows.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn keep(&self, key: &str, answered: &Answered) -> Result<(), FleetError> {
        self.write(&self.verdict_file(key), &answered.verdict)?;
        self.write(&self.answer_file(key), &Answered { verdict: Value::Null, ..answered.clone() })
    }

    /// The key of a recording's answer, where it was answered. `question` is [`super::key::Keys::question`].
    pub fn key_of(&self, entry: &Entry, question: &str) -> Option<String> {
        let pointer: Pointer = serde_json::from_slice(&std::fs::read(self.pointer_file(entry, question)).ok()?).ok()?;
        (pointer.recording == entry.name).then_some(pointer.key)
    }

    /// Number of recordings that are answered, to whatever question.
    pub(super) fn count(&self) -> usize {
        std::fs::read_dir(self.folder.join("done")).map_or(0, Iterator::count)
    }

    /// Points from a recording to its answer.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn point(&self, entry: &Entry, question: &str, key: &str) -> Result<(), FleetError> {
        if self.key_of(entry, question).as_deref() == Some(key) {
            return Ok(());
        }
        self.write(&self.pointer_file(entry, question), &Pointer { recording: entry.name.clone(), key: key.to_string() })
    }

    /// The file of an answer's verdict.
    pub fn verdict_file(&self, key: &str) -> PathBuf {
        self.folder.join("verdicts").join(format!("{key}.json"))
    }

    fn answer_file(&self, key: &str) -> PathBuf {
        self.folder.join("answers").join(format!("{key}.json"))
    }

    fn pointer_file(&self, entry: &Entry, question: &str) -> PathBuf {
        self.folder.join("done").join(format!("{}.json", short(&[question.as_bytes(), entry.name.as_bytes()])))
    }

    fn write(&self, path: &Path, value: &impl Serialize) -> Result<(), FleetError> {
        let mut text = serde_json::to_vec(value).map_err(FleetError::input)?;
        text.push(b'\n');
        self.replace(path, |file| file.write_all(&text))
    }

    /// Writes a file that is in its place whole or not at all.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn replace(&self, path: &Path, write: impl FnOnce(&mut std::fs::File) -> std::io::Result<()>) -> Result<(), FleetError> {
        let failed = |e: std::io::Error| FleetError::file(path, format!("cannot be written: {e}"));
        let folder = path.parent().unwrap_or(Path::new("."));
        let mut made = tempfile::Builder::new().prefix(".backdrive-").tempfile_in(folder).map_err(failed)?;
        write(made.as_file_mut()).map_err(failed)?;
        let made = made.into_temp_path();
        let permissions = std::os::unix::fs::PermissionsExt::from_mode(0o644);
        std::fs::set_permissions(&made, permissions).map_err(failed)?;
        move_into_place(&made, path).map_err(failed)
    }
}
