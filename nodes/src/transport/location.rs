//! Where the nodes of one run meet on this machine.

use super::error::TransportError;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Where shared memory is mounted. A file on a disk would do, but its write-back stalls writers.
pub(crate) const SHM: &str = "/dev/shm";

/// Where the nodes of one run meet on this machine. Two runs with different locations never meet,
/// whatever their topics are called.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Location {
    /// Begins the name of everything that the run keeps in `/dev/shm`: letters, digits, `_` and `-`, at most 64.
    pub prefix: String,
    /// Directory of the run's other files. Absolute, and the run's own.
    pub root: PathBuf,
}

impl Location {
    /// Whether the prefix can be one.
    pub(crate) fn check(&self) -> Result<(), TransportError> {
        let valid = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if self.prefix.is_empty() || self.prefix.len() > 64 || !self.prefix.chars().all(valid) {
            return Err(TransportError::Start(format!(
                "`{}` cannot name a run: expected 1 to 64 letters, digits, `_` or `-`",
                self.prefix
            )));
        }
        Ok(())
    }

    /// Removes everything that the run has left. Only for a run of which no process lives any more.
    ///
    /// # Errors
    /// The prefix is not one, or a file of the run cannot be removed.
    pub fn remove(&self) -> Result<(), TransportError> {
        self.check()?;
        let failed = |path: &std::path::Path, e: std::io::Error| TransportError::Start(format!("cannot remove {}: {e}", path.display()));
        let absent = |e: &std::io::Error| e.kind() == std::io::ErrorKind::NotFound;
        if let Err(e) = std::fs::remove_dir_all(&self.root)
            && !absent(&e)
        {
            return Err(failed(&self.root, e));
        }
        let shm = PathBuf::from(SHM);
        let entries = std::fs::read_dir(&shm).map_err(|e| failed(&shm, e))?;
        for entry in entries.flatten() {
            if entry.file_name().to_string_lossy().starts_with(&self.prefix) {
                match std::fs::remove_file(entry.path()) {
                    Err(e) if !absent(&e) => return Err(failed(&entry.path(), e)),
                    _ => {}
                }
            }
        }
        Ok(())
    }
}

/// 64-bit FNV-1a, for names in shared memory; never 0.
pub(crate) fn name_hash(name: &str) -> u64 {
    let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
    hash.max(1)
}
