//! Recordings as a caller gives them.

use backdrive_plant::set::RecordingSet;
use std::path::{Path, PathBuf};

/// Recordings as a caller gives them.
#[derive(Debug, Clone)]
pub enum Recordings {
    /// A folder with set.toml, a set.toml, a folder of recordings, or recordings.
    Files(Vec<PathBuf>),
    /// A set that a program states, whose recordings may be in memory.
    Set(Box<RecordingSet>),
}

impl Recordings {
    /// The set or the recording, for titles.
    pub fn name(&self) -> String {
        let of = |path: &Path| path.file_name().map_or(path.display().to_string(), |n| n.to_string_lossy().into_owned());
        match self {
            Recordings::Files(paths) => paths.first().map_or(String::new(), |path| of(path)),
            Recordings::Set(set) => set.fit.iter().chain(&set.held_out).next().map_or(String::new(), |file| of(Path::new(file))),
        }
    }

    /// Where the first of them is, for errors.
    pub(crate) fn first(&self) -> String {
        match self {
            Recordings::Files(paths) => paths.first().map_or(String::new(), |path| path.display().to_string()),
            Recordings::Set(_) => self.name(),
        }
    }
}

impl Default for Recordings {
    fn default() -> Recordings {
        Recordings::Files(Vec::new())
    }
}

impl From<Vec<PathBuf>> for Recordings {
    fn from(paths: Vec<PathBuf>) -> Recordings {
        Recordings::Files(paths)
    }
}

impl From<&Path> for Recordings {
    fn from(path: &Path) -> Recordings {
        Recordings::Files(vec![path.to_path_buf()])
    }
}
