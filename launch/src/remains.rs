//! What a run has on the machine, and how it is removed: nothing is an error that is gone already.

use crate::proc_stat::ProcStat;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// When a process started, clock ticks since boot; `None` if it is gone or only waits to be reaped.
pub(crate) fn start_time(pid: i32) -> Option<u64> {
    ProcStat::of(pid).map(|stat| stat.started)
}

/// Files in shared memory whose names begin with one of these.
pub(crate) fn shm_files(shm: &Path, prefixes: &[&str]) -> std::io::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(shm)?.flatten().map(|e| e.path());
    Ok(entries.filter(|path| prefixes.iter().any(|p| name_of(path).starts_with(p))).collect())
}

pub(crate) fn remove_file(path: &Path) -> std::io::Result<()> {
    absent_is_fine(std::fs::remove_file(path))
}

/// Removes the directory of a run. The lock goes last: a removal that is cut short leaves a run that is seen to be dead.
pub(crate) fn remove_run(root: &Path, lock: &str) -> std::io::Result<()> {
    let entries = match std::fs::read_dir(root) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        entries => entries?,
    };
    for entry in entries {
        let entry = entry?;
        if entry.file_name() == lock {
            continue;
        }
        let is_folder = entry.file_type()?.is_dir();
        absent_is_fine(if is_folder { std::fs::remove_dir_all(entry.path()) } else { std::fs::remove_file(entry.path()) })?;
    }
    remove_file(&root.join(lock))?;
    absent_is_fine(std::fs::remove_dir(root))
}

fn absent_is_fine(result: std::io::Result<()>) -> std::io::Result<()> {
    match result {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

pub(crate) fn name_of(path: &Path) -> &str {
    path.file_name().and_then(|n| n.to_str()).unwrap_or_default()
}
