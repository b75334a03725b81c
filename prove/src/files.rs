//! Files of a proof, and the program `backdrive` run beside them.

use crate::error::ProveError;
use backdrive_bags::move_into_place;
use std::path::Path;
use std::process::{Command, Stdio};

/// A path as text that a file of ours can hold wherever it lies.
pub(super) fn absolute(path: &Path) -> Result<String, ProveError> {
    std::path::absolute(path).map(|p| p.display().to_string()).map_err(|e| ProveError::write(path, e))
}

/// Runs a verb of the program `backdrive` in a process of its own, its output in a file beside the case; what it said.
pub(super) fn ours(backdrive: &Path, folder: &Path, name: &str, arguments: &[&dyn AsRef<std::ffi::OsStr>]) -> Result<String, ProveError> {
    let log = folder.join(format!("{name}.log"));
    let file = std::fs::File::create(&log).map_err(|e| ProveError::write(&log, e))?;
    let errors = file.try_clone().map_err(ProveError::machine)?;
    let mut command = Command::new(backdrive);
    command.args(arguments).stdin(Stdio::null()).stdout(file).stderr(errors);
    let status = command.status().map_err(ProveError::machine)?;
    let said = std::fs::read_to_string(&log).unwrap_or_default();
    // 1 is a negative answer, which is one.
    match status.code() {
        Some(0 | 1 | 7) => Ok(said),
        _ => {
            let why = said.lines().rev().find_map(|line| line.strip_prefix("error: ")).unwrap_or("see its output");
            Err(ProveError::input(format!("{name} ended with {status}: {why} ({})", log.display())))
        }
    }
}

/// Reads a text file.
pub(super) fn read(path: &Path) -> Result<String, ProveError> {
    backdrive_plant::input_file::read_to_string(path).map_err(|e| ProveError::input(format!("{}: cannot be read: {e}", path.display())))
}

/// Writes a file: it is in its place whole or not at all.
pub(super) fn write(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), ProveError> {
    let failed = |e: std::io::Error| ProveError::write(path, e);
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(failed)?;
    let beside = tempfile::Builder::new().prefix(".backdrive-").tempdir_in(folder).map_err(failed)?;
    let made = beside.path().join(path.file_name().unwrap_or_default());
    std::fs::write(&made, contents).map_err(failed)?;
    move_into_place(&made, path).map_err(failed)
}

/// What is being done with a case, for the status line.
pub(super) fn at(folder: &Path, doing: &str) -> String {
    format!("{}: {doing}", folder.display())
}
