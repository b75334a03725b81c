//! The secret that the hosts of a run share: a file of 64 hexadecimal digits that only its user can read.

use backdrive_nodes::transport::ros2::Key;
use std::io::{Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::Path;

/// More than a secret and the white space around it, bytes.
const LONGEST: u64 = 256;

/// Makes one. A file that exists is not replaced: runs may use it.
///
/// # Errors
/// The file exists, or cannot be written.
pub fn create(path: &Path) -> Result<(), String> {
    let failed = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::AlreadyExists => {
            format!("{}: exists already, and hosts may use it; remove it first, or give another name", path.display())
        }
        _ => format!("{}: cannot be written: {e}", path.display()),
    };
    let key = Key::fresh()?;
    let mut file = std::fs::OpenOptions::new().write(true).create_new(true).mode(0o600).open(path).map_err(failed)?;
    writeln!(file, "{}", key.to_hex()).map_err(failed)
}

/// Reads one that [`create`] made.
///
/// # Errors
/// It cannot be read, is no regular file, can be read by others, or holds something else.
pub fn read(path: &Path) -> Result<Key, String> {
    let name = path.display();
    // A pipe with this name must not hold the program up.
    let file = std::fs::OpenOptions::new()
        .read(true)
        .custom_flags(nix::libc::O_NONBLOCK)
        .open(path)
        .map_err(|e| format!("{name}: cannot be read: {e}; make a secret with `backdrive secret {name}` and copy it to each host"))?;
    let meta = file.metadata().map_err(|e| format!("{name}: cannot be read: {e}"))?;
    if !meta.is_file() {
        return Err(format!("{name}: is not a regular file; make a secret with `backdrive secret FILE`"));
    }
    if meta.mode() & 0o077 != 0 {
        return Err(format!("{name}: others can read it (mode {:o}); `chmod 600 {name}`", meta.mode() & 0o777));
    }
    let mut text = String::new();
    file.take(LONGEST).read_to_string(&mut text).map_err(|e| format!("{name}: cannot be read: {e}"))?;
    Key::from_hex(text.trim()).ok_or_else(|| format!("{name}: expected 64 hexadecimal digits; make a secret with `backdrive secret FILE`"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn a_secret_is_made_once_for_its_user_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.secret");
        assert!(read(&path).unwrap_err().contains("backdrive secret"));
        create(&path).unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().mode() & 0o777, 0o600);
        let key = read(&path).unwrap();
        assert!(create(&path).unwrap_err().contains("exists already"));
        assert_eq!(read(&path), Ok(key));
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o640)).unwrap();
        assert!(read(&path).unwrap_err().contains("chmod 600"));
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).unwrap();
        for wrong in [&b""[..], b"secret", &[b'a'; 63], &[b'a'; 65], &[0xff; 64], &[b'a'; 1000]] {
            std::fs::write(&path, wrong).unwrap();
            assert!(read(&path).is_err(), "{wrong:?}");
        }
        let pipe = folder.path().join("pipe");
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRUSR | nix::sys::stat::Mode::S_IWUSR).unwrap();
        assert!(read(&pipe).unwrap_err().contains("not a regular file"));
        assert!(read(folder.path()).is_err());
    }
}
