//! Where the parts of a run are on this machine.

use crate::error::LaunchError;
use backdrive_nodes::transport::Location;
use std::path::{Path, PathBuf};

/// Where the things of a run are: what a process needs that belongs to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunPaths {
    pub(crate) root: PathBuf,
    pub(crate) id: String,
}

impl RunPaths {
    /// The run whose directory this is, such as a node gets it with `--run`.
    ///
    /// # Errors
    /// It is not the directory of a run.
    pub fn open(root: &Path) -> Result<RunPaths, LaunchError> {
        let advice = "give the directory that the supervisor made";
        let root = std::path::absolute(root).map_err(|e| failed(root, "find it", e, advice))?;
        let id = root.file_name().and_then(|n| n.to_str()).filter(|n| is_id(n)).map(str::to_string);
        match id {
            Some(id) if root.join(GRAPH).is_file() => Ok(RunPaths { root, id }),
            _ => Err(failed(&root, "join it", "it is not the directory of a run", advice)),
        }
    }

    /// Name of the run: 20 hexadecimal digits.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// The directory.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The graph.
    pub fn graph(&self) -> PathBuf {
        self.root.join(GRAPH)
    }

    /// Where its nodes meet, if that is not shared memory alone.
    pub fn place(&self) -> PathBuf {
        self.root.join(PLACE)
    }

    /// Who the run is on the network: only its user can read it.
    pub fn identity(&self) -> PathBuf {
        self.root.join(IDENTITY)
    }

    /// Where the supervisor can be asked for something while the run lasts.
    pub fn asks(&self) -> PathBuf {
        self.root.join(ASKS)
    }

    /// What the names of the run's files in shared memory begin with.
    pub fn prefix(&self) -> String {
        prefix_of(&self.id)
    }

    /// Where the transport meets.
    pub fn location(&self) -> Location {
        Location { prefix: self.prefix(), root: self.root.join(MIDDLEWARE) }
    }
}

pub(crate) fn prefix_of(id: &str) -> String {
    format!("bd{id}_")
}

/// Whether a file name is the name of a run.
pub(crate) fn is_id(name: &str) -> bool {
    name.len() == 20 && name.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
}

pub(crate) const GRAPH: &str = "graph.toml";

pub(crate) const PLACE: &str = "place.json";

pub(crate) const ASKS: &str = "asks.sock";

pub(crate) const IDENTITY: &str = "identity.json";

pub(crate) const MIDDLEWARE: &str = "middleware";

pub(crate) fn failed(path: &Path, action: &'static str, reason: impl ToString, advice: &'static str) -> LaunchError {
    LaunchError::RunDir { path: path.to_path_buf(), action, reason: reason.to_string(), advice }
}
