//! What a run has on the machine, and how it is removed: nothing is an error that is gone already.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// When a process started, clock ticks since boot; `None` if it is gone or only waits to be reaped.
pub(crate) fn start_time(pid: i32) -> Option<u64> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The program's name is in parentheses and may hold anything.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace();
    if matches!(fields.next()?, "Z" | "X") {
        return None;
    }
    fields.nth(18)?.parse().ok()
}

/// Files in shared memory whose names begin with one of these.
pub(crate) fn shm_files(shm: &Path, prefixes: &[&str]) -> std::io::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(shm)?.flatten().map(|e| e.path());
    Ok(entries.filter(|path| prefixes.iter().any(|p| name_of(path).starts_with(p))).collect())
}

pub(crate) fn remove_file(path: &Path) -> std::io::Result<()> {
    absent_is_fine(std::fs::remove_file(path))
}

pub(crate) fn remove_dir(path: &Path) -> std::io::Result<()> {
    absent_is_fine(std::fs::remove_dir_all(path))
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
