//! What the processes of a run do when their supervisor is gone: the last of them removes what the run has on the machine.
//!
//! Each holds a shared lock for as long as it lives. One that ends without a supervisor tries to hold it alone: who can is the last. A process that
//! was killed has no such moment; if all were killed, the next start removes what remains.

use crate::paths::RunPaths;
use crate::remains::{remove_file, remove_run, shm_files};
use crate::rundir::{LOCK, PROCESSES, try_lock};
use nix::fcntl::{Flock, FlockArg};
use nix::unistd::{Pid, getppid};
use std::fs::{File, OpenOptions};
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// How often, and how long apart, the lock of the supervisor is looked at: the system frees it a moment after its process is gone.
const LOOKS: (usize, Duration) = (20, Duration::from_millis(10));

/// A process of a run.
struct Share {
    paths: RunPaths,
    supervisor: Pid,
    lock: Flock<File>,
}

static SHARE: Mutex<Option<Share>> = Mutex::new(None);

/// Takes part in a run, until this process ends.
///
/// # Errors
/// The run is being removed, or cannot be read.
pub(crate) fn take_part(paths: &RunPaths) -> Result<(), String> {
    let path = paths.root().join(PROCESSES);
    let gone = || format!("{}: the run has ended", paths.root().display());
    let file = match OpenOptions::new().read(true).write(true).open(&path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Err(gone()),
        file => file.map_err(|e| format!("{}: cannot be opened: {e}", path.display()))?,
    };
    let lock = Flock::lock(file, FlockArg::LockSharedNonblock).map_err(|_| gone())?;
    // Removed between opening and locking.
    if lock.metadata().is_ok_and(|m| m.nlink() == 0) {
        return Err(gone());
    }
    let share = Share { paths: paths.clone(), supervisor: getppid(), lock };
    if SHARE.lock().unwrap_or_else(PoisonError::into_inner).replace(share).is_none() {
        // SAFETY: the function neither unwinds nor needs anything that is gone by then. A process ends at several places, also where its
        // loop hangs in a step, and each of them comes by here.
        unsafe { nix::libc::atexit(leave) };
    }
    Ok(())
}

extern "C" fn leave() {
    let share = SHARE.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some(share) = share {
        share.leave(Path::new("/dev/shm"));
    }
}

impl Share {
    /// Removes the run if its supervisor is dead and this process is its last.
    fn leave(self, shm: &Path) {
        // With a parent that lives there is somebody who cleans up.
        if getppid() == self.supervisor {
            return;
        }
        let Some(_supervisor) = dead(&self.paths.root().join(LOCK)) else { return };
        // One that cannot be had has given up the shared one too, so that of several at once the last gets it.
        if self.lock.relock(FlockArg::LockExclusiveNonblock).is_err() {
            return;
        }
        for file in shm_files(shm, &[&self.paths.prefix()]).unwrap_or_default() {
            let _ = remove_file(&file);
        }
        let _ = remove_run(self.paths.root(), LOCK);
    }
}

/// The lock of a supervisor that is gone.
fn dead(lock: &Path) -> Option<Flock<File>> {
    let (looks, apart) = LOOKS;
    for _ in 0..looks {
        match try_lock(lock) {
            Ok(Some(lock)) => return Some(lock),
            Ok(None) => std::thread::sleep(apart),
            // Somebody has removed the run.
            Err(_) => return None,
        }
    }
    None
}
