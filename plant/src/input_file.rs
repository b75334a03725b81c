//! The one way to open a file that is to be read.
//!
//! Only a regular file is opened: a named pipe waits for a writer that may never come, a device has no end, and both hang a program that
//! reads them. A pipe that the shell itself hands over (`/dev/stdin`, or `/dev/fd/63` of `<(...)`) is read, for the user put it there.

use std::fs::{File, FileType};
use std::io::{Error, ErrorKind, Read, Result};
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

/// Opens a regular file, or a pipe that the shell hands over, for reading.
///
/// # Errors
/// It is missing, may not be read, or is a folder, a named pipe, a device or a socket; the error is a sentence without the path.
pub fn open(path: &Path) -> Result<File> {
    // Looked at before it is opened: to open a named pipe is to wait for its writer, and to open a device may set it going.
    check(path, std::fs::metadata(path)?.file_type())?;
    let file = File::open(path)?;
    // It may have been exchanged in between.
    check(path, file.metadata()?.file_type())?;
    Ok(file)
}

/// All bytes of a file that [`open`] opens.
///
/// # Errors
/// As [`open`], or it cannot be read to its end.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let mut file = open(path)?;
    let mut bytes = Vec::with_capacity(file.metadata().map_or(0, |about| about.len() as usize));
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The text of a file that [`open`] opens.
///
/// # Errors
/// As [`read`], or it is not UTF-8 text.
pub fn read_to_string(path: &Path) -> Result<String> {
    String::from_utf8(read(path)?).map_err(|e| Error::new(ErrorKind::InvalidData, e))
}

fn check(path: &Path, kind: FileType) -> Result<()> {
    let what = if kind.is_file() || kind.is_fifo() && is_handed_over(path) {
        return Ok(());
    } else if kind.is_dir() {
        return Err(Error::from(ErrorKind::IsADirectory));
    } else if kind.is_fifo() {
        "a named pipe"
    } else if kind.is_char_device() || kind.is_block_device() {
        "a device"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "something else"
    };
    Err(Error::new(ErrorKind::InvalidInput, format!("it is {what}, expected a regular file; copy its content into a file first")))
}

fn is_handed_over(path: &Path) -> bool {
    path == Path::new("/dev/stdin") || path.starts_with("/dev/fd") || path.starts_with("/proc/self/fd")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_regular_file_is_opened_and_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "text").unwrap();
        assert_eq!(read_to_string(&file).unwrap(), "text");
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&file, &link).unwrap();
        assert_eq!(read(&link).unwrap(), b"text");
        let socket = folder.path().join("socket");
        let _listens = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for (path, what) in [(Path::new("/dev/zero"), "a device"), (&socket, "a socket"), (&pipe, "a named pipe")] {
            let error = open(path).unwrap_err();
            assert!(error.to_string().contains(what), "{}: {error}", path.display());
        }
        assert_eq!(open(folder.path()).unwrap_err().kind(), ErrorKind::IsADirectory);
        assert_eq!(open(&folder.path().join("none")).unwrap_err().kind(), ErrorKind::NotFound);
    }
}
