//! A file that is in its place whole or not at all.
//!
//! It is written under another name in the same folder and moved to its own name once it is on the disk. A writer that fails, or is dropped
//! before its end, leaves what was there before, and removes what it has written.

use crate::BagError;
use crate::claim::{check_target, failed, folder_of, lock, nameless};
use std::fs::{File, Permissions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// What the names of unfinished files begin with.
const UNFINISHED: &str = ".backdrive-";

/// A bag in the making.
#[derive(Debug)]
pub(crate) struct Whole {
    path: PathBuf,
    overwrite: bool,
    made: NamedTempFile,
}

impl Whole {
    /// Begins a bag beside its place. Errors: those of [`check_target`].
    pub(crate) fn begin(path: &Path, overwrite: bool) -> Result<Whole, BagError> {
        check_target(path, overwrite)?;
        let folder = folder_of(&behind_links(path));
        // Like any file that a program makes: what the user's mask leaves of it.
        let mode = Permissions::from_mode(0o666);
        let made = tempfile::Builder::new().prefix(UNFINISHED).permissions(mode).tempfile_in(folder);
        let made = made.map_err(|e| failed(path)(nameless(&e)))?;
        Ok(Whole { path: path.to_owned(), overwrite, made })
    }

    /// The file to write to.
    pub(crate) fn file(&self) -> Result<File, BagError> {
        self.made.as_file().try_clone().map_err(failed(&self.path))
    }

    /// Moves it to its place. Errors: what the disk refuses late; somebody else made or writes a file there meanwhile.
    pub(crate) fn commit(self) -> Result<(), BagError> {
        let Whole { path, overwrite, made } = self;
        let place = behind_links(&path);
        let mut made = made.into_temp_path();
        settle(&made, &place).map_err(failed(&path))?;
        if !place.exists() {
            match made.persist_noclobber(&place) {
                Ok(()) => {
                    sync_folder(&place);
                    return Ok(());
                }
                Err(e) if e.error.kind() == ErrorKind::AlreadyExists => made = e.path,
                Err(e) => return Err(failed(&path)(e.error)),
            }
        }
        // Held until the file is in its place: no other writer begins there meanwhile.
        let _before = lock(&path, overwrite)?;
        made.persist(&place).map_err(|e| failed(&path)(e.error))?;
        sync_folder(&place);
        Ok(())
    }
}

/// A file name that is not taken: the given one, or `NAME-2.EXT`, `NAME-3.EXT`, ...
pub fn free(path: &Path) -> PathBuf {
    let taken = |path: &Path| path.symlink_metadata().is_ok();
    if !taken(path) {
        return path.to_path_buf();
    }
    let stem = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let ending = path.extension().map_or_else(String::new, |e| format!(".{}", e.to_string_lossy()));
    let numbered = (2_u32..).map(|number| path.with_file_name(format!("{stem}-{number}{ending}")));
    numbered.into_iter().find(|path| !taken(path)).unwrap_or_else(|| path.to_path_buf())
}

/// Moves a file that is complete to its place, over one that is there, whose permissions it takes over. It is on the disk before it has its
/// name: what the disk refuses late it refuses here, and the file of before is still there.
///
/// # Errors
/// The disk refuses it, or it cannot have that name.
pub fn move_into_place(made: &Path, place: &Path) -> io::Result<()> {
    settle(made, place)?;
    std::fs::rename(made, place)?;
    sync_folder(place);
    Ok(())
}

fn settle(made: &Path, place: &Path) -> io::Result<()> {
    let file = File::open(made)?;
    if let Ok(before) = std::fs::metadata(place) {
        file.set_permissions(before.permissions())?;
    }
    file.sync_all()
}

/// So that the name survives a power failure as the contents do. A file system that cannot do it does what it can.
fn sync_folder(place: &Path) {
    let _ = File::open(folder_of(place)).and_then(|folder| folder.sync_all());
}

/// A link stays a link: what it points at is replaced.
fn behind_links(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}
