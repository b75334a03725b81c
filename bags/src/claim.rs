//! A file that is about to be written: no other writer has it, and it holds nothing that was not given up.

use crate::BagError;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

/// Opens a file for a bag, empty and locked while it is open: a second writer is refused, whatever its options.
///
/// A file that holds something is replaced only with `overwrite`, and only if it is a bag. What is no regular file (a
/// device, a pipe) is refused: a bag is written at several places and read again at the end. Errors: [`BagError::Exists`], [`BagError::InUse`], [`BagError::Create`].
pub(crate) fn claim(path: &Path, overwrite: bool) -> Result<File, BagError> {
    let file = lock(path, overwrite)?;
    file.set_len(0).map_err(failed(path))?;
    Ok(file)
}

/// Whether a bag could be written here now: the errors that writing it would begin with, and no trace left.
///
/// Whoever writes it later may still be refused, when another was faster.
pub fn check_target(path: &Path, overwrite: bool) -> Result<(), BagError> {
    match std::fs::symlink_metadata(path) {
        // Nothing under its name, not even for a moment: a process that is killed just then would leave it.
        Err(e) if e.kind() == ErrorKind::NotFound && path.file_name().is_some() => {
            tempfile::tempfile_in(folder_of(path)).map(drop).map_err(|e| failed(path)(nameless(&e)))
        }
        _ => lock(path, overwrite).map(drop),
    }
}

/// Opens what is at a path, or makes it, and locks it.
pub(crate) fn lock(path: &Path, overwrite: bool) -> Result<File, BagError> {
    loop {
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
        if file.as_ref().is_err_and(|e| e.kind() == ErrorKind::PermissionDenied) {
            file = OpenOptions::new().write(true).open(path); // a device that can be written only
        }
        let mut file = file.map_err(failed(path))?;
        let before = file.metadata().map_err(failed(path))?;
        if !before.is_file() {
            return Err(no_file(path, file, before.file_type()));
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
        return Ok(file);
    }
}

/// Why a device or a pipe takes no bag: its own error where it takes nothing at all, such as `/dev/full`.
fn no_file(path: &Path, mut file: File, kind: std::fs::FileType) -> BagError {
    let refused = if kind.is_char_device() { file.write_all(&[0]).err() } else { None };
    let why = "it is a device or a pipe, from which a bag cannot be read back; name a file";
    failed(path)(refused.unwrap_or_else(|| std::io::Error::new(ErrorKind::InvalidInput, why)))
}

pub(crate) fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> BagError + use<> {
    let path = path.to_owned();
    move |source| BagError::Create { path, source }
}

/// The folder of a file.
pub(crate) fn folder_of(path: &Path) -> PathBuf {
    path.parent().filter(|f| !f.as_os_str().is_empty()).map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

/// The same error without the name of a temporary file, which means nothing to a user.
pub(crate) fn nameless(error: &std::io::Error) -> std::io::Error {
    error.raw_os_error().map_or_else(|| std::io::Error::from(error.kind()), std::io::Error::from_raw_os_error)
}

/// A bag that is made of another is not written over it.
pub(crate) fn not_itself(from: &Path, to: &Path) -> Result<(), BagError> {
    match (from.canonicalize(), to.canonicalize()) {
        (Ok(a), Ok(b)) if a == b => Err(BagError::Usage(format!("{}: is the bag that is read; name another to be written", to.display()))),
        _ => Ok(()),
    }
}
