//! The folder with answers, and its files.

use super::key::short;
use crate::answered::Answered;
use crate::error::FleetError;
use crate::manifest::Entry;
use backdrive_bags::move_into_place;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// What the names of unfinished files begin with.
const UNFINISHED: &str = ".backdrive-";
/// A writer locks its unfinished file within an instant of making it; one younger than this is left alone.
const YOUNG: Duration = Duration::from_secs(60);

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
    /// Opens a folder; it is made where it is not there. Unfinished files of writers that are no more are removed.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn open(folder: &Path) -> Result<Store, FleetError> {
        for below in ["answers", "verdicts", "done"] {
            let path = folder.join(below);
            std::fs::create_dir_all(&path).map_err(|e| FleetError::file(&path, format!("cannot be made: {e}")))?;
            remove_unfinished(&path);
        }
        remove_unfinished(folder);
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
        let mut made = tempfile::Builder::new().prefix(UNFINISHED).tempfile_in(folder).map_err(failed)?;
        // The lock ends with the process, however that ends. A file system without locks keeps what a killed writer leaves.
        let _ = made.as_file().try_lock();
        write(made.as_file_mut()).map_err(failed)?;
        let (_locked, made) = made.into_parts();
        let permissions = std::os::unix::fs::PermissionsExt::from_mode(0o644);
        std::fs::set_permissions(&made, permissions).map_err(failed)?;
        move_into_place(&made, path).map_err(failed)
    }
}

/// Removes what writers that were killed have left in a folder: unfinished files whose lock nobody holds.
fn remove_unfinished(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let is_unfinished = entry.file_name().to_string_lossy().starts_with(UNFINISHED);
        let age = entry.metadata().ok().filter(std::fs::Metadata::is_file).and_then(|of| of.modified().ok()?.elapsed().ok());
        if !is_unfinished || age.is_none_or(|age| age < YOUNG) {
            continue;
        }
        // Held while it is removed, so that no two remove one.
        if let Ok(file) = File::options().write(true).open(entry.path())
            && file.try_lock().is_ok()
        {
            // One that cannot be removed harms nobody.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unfinished_files_of_dead_writers_are_removed_and_those_of_living_ones_stay() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let file = |name: &str, old: bool| {
            let path = folder.path().join("answers").join(name);
            let file = File::create(&path).unwrap();
            if old {
                file.set_modified(std::time::SystemTime::now() - 2 * YOUNG).unwrap();
            }
            (path, file)
        };
        let (dead, dead_file) = file(".backdrive-dead", true);
        drop(dead_file);
        let (living, living_file) = file(".backdrive-living", true);
        living_file.try_lock().unwrap();
        let (young, _) = file(".backdrive-young", false);
        let (answer, _) = file("answer.json", true);
        let again = Store::open(store.folder()).unwrap();
        assert!(!dead.exists() && living.exists() && young.exists() && answer.exists());
        again.replace(&answer, |file| file.write_all(b"whole")).unwrap();
        assert_eq!(std::fs::read(&answer).unwrap(), b"whole");
    }
}
