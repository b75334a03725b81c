//! A file that is about to be written: nobody else's, and nothing in it that was not given up.

use crate::BagError;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Opens a file for a bag, empty and locked for as long as it is open: a second writer is refused, whatever it was told.
///
/// A file that holds something is replaced only with `overwrite`, and only if it is a bag. What is no regular file (a
/// device, a pipe) is taken as it is. Errors: [`BagError::Exists`], [`BagError::InUse`], [`BagError::Create`].
pub(crate) fn claim(path: &Path, overwrite: bool) -> Result<File, BagError> {
    let (file, regular) = lock(path, overwrite)?;
    if regular {
        file.set_len(0).map_err(failed(path))?;
    }
    Ok(file)
}

/// Whether a bag could be written here now: the errors that writing it would begin with, and no trace left.
///
/// Whoever writes it later may still be refused, when another was faster.
pub fn check_target(path: &Path, overwrite: bool) -> Result<(), BagError> {
    let existed = path.exists();
    let (_file, regular) = lock(path, overwrite)?;
    // Removed while the lock is held: one that has opened it meanwhile sees that it is gone, and begins again.
    if !existed && regular {
        let _ = std::fs::remove_file(path);
    }
    Ok(())
}

fn lock(path: &Path, overwrite: bool) -> Result<(File, bool), BagError> {
    loop {
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
        if file.as_ref().is_err_and(|e| e.kind() == ErrorKind::PermissionDenied) {
            file = OpenOptions::new().write(true).open(path); // a device that can be written only
        }
        let mut file = file.map_err(failed(path))?;
        let before = file.metadata().map_err(failed(path))?;
        if !before.is_file() {
            return Ok((file, false));
        }
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(BagError::InUse { path: path.to_owned() }),
            // A file system that knows no locks: then only what is there protects itself.
            Err(TryLockError::Error(_)) => {}
        }
        let now = file.metadata().map_err(failed(path))?;
        if now.nlink() == 0 {
            continue; // removed between opening and locking
        }
        if now.len() > 0 {
            let mut start = [0; mcap::MAGIC.len()];
            let is_bag = file.read_exact(&mut start).is_ok() && start == mcap::MAGIC;
            if !is_bag || !overwrite {
                return Err(BagError::Exists { path: path.to_owned(), is_bag });
            }
            file.seek(SeekFrom::Start(0)).map_err(failed(path))?;
        }
        return Ok((file, true));
    }
}

fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> BagError + use<> {
    let path = path.to_owned();
    move |source| BagError::Create { path, source }
}

/// A bag that is made of another is not written over it.
pub(crate) fn not_itself(from: &Path, to: &Path) -> Result<(), BagError> {
    match (from.canonicalize(), to.canonicalize()) {
        (Ok(a), Ok(b)) if a == b => Err(BagError::Usage(format!("{}: is the bag that is read; name another to be written", to.display()))),
        _ => Ok(()),
    }
}
