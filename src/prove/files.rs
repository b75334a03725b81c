//! Files of a proof, and this program run again beside them.

use crate::failure::Failure;
use crate::output;
use std::path::Path;
use std::process::{Command, Stdio};

/// A path as text that a file of ours can hold wherever it lies.
pub(super) fn absolute(path: &Path) -> Result<String, Failure> {
    std::path::absolute(path).map(|p| p.display().to_string()).map_err(|e| Failure::write(path, e))
}

/// Runs this program again as a process of its own, its output in a file beside the case; what it said.
pub(super) fn ours(folder: &Path, name: &str, arguments: &[&dyn AsRef<std::ffi::OsStr>]) -> Result<String, Failure> {
    let exe = std::env::current_exe().map_err(Failure::machine)?;
    let log = folder.join(format!("{name}.log"));
    let file = std::fs::File::create(&log).map_err(|e| Failure::write(&log, e))?;
    let errors = file.try_clone().map_err(Failure::machine)?;
    let mut command = Command::new(exe);
    command.args(arguments).stdin(Stdio::null()).stdout(file).stderr(errors);
    let status = command.status().map_err(Failure::machine)?;
    let said = std::fs::read_to_string(&log).unwrap_or_default();
    // 1 is a negative answer, which is one.
    match status.code() {
        Some(0 | 1 | 7) => Ok(said),
        _ => {
            let why = said.lines().rev().find_map(|line| line.strip_prefix("error: ")).unwrap_or("its output says why");
            Err(Failure::input(format!("{name} ended with {status}: {why} ({})", log.display())))
        }
    }
}

/// Reads a text file.
pub(super) fn read(path: &Path) -> Result<String, Failure> {
    backdrive_plant::input_file::read_to_string(path).map_err(|e| Failure::input(format!("{}: cannot be read: {e}", path.display())))
}

/// Writes a text file.
pub(super) fn write(path: &Path, text: &str) -> Result<(), Failure> {
    output::file(path, text)
}

/// What is being done with a case, for the status line.
pub(super) fn at(folder: &Path, doing: &str) -> String {
    format!("{}: {doing}", folder.display())
}
