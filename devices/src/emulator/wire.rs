//! The wire of an emulator: a pty, or a UNIX socket that carries CAN frames.

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::{read, ttyname, write};
use std::io::ErrorKind;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::path::{Path, PathBuf};

/// A wire that can be pulled.
pub enum Wire {
    /// Our end of a pty, and the other one, which keeps the port open while nobody has it.
    Pty(OwnedFd, #[allow(dead_code, reason = "only kept open")] OwnedFd),
    /// A socket, and who spoke last.
    Socket(UnixDatagram, Option<SocketAddr>, PathBuf),
    /// The cable is pulled.
    Pulled,
}

/// What arrived.
pub enum Arrived {
    /// This many bytes.
    Bytes(usize),
    /// Nothing, and the other end is not open.
    Nobody,
    /// Nothing.
    Nothing,
}

impl Wire {
    /// A pty, and the path of its port.
    ///
    /// # Errors
    /// The machine gives none: a sentence.
    pub fn pty() -> Result<(Wire, PathBuf), String> {
        let wrong = |e: Errno| e.desc().to_string();
        let pty = openpty(None, None).map_err(wrong)?;
        let mut settings = tcgetattr(pty.slave.as_fd()).map_err(wrong)?;
        cfmakeraw(&mut settings);
        tcsetattr(pty.slave.as_fd(), SetArg::TCSANOW, &settings).map_err(wrong)?;
        fcntl(pty.master.as_fd(), FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).map_err(wrong)?;
        let port = ttyname(pty.slave.as_fd()).map_err(wrong)?;
        Ok((Wire::Pty(pty.master, pty.slave), port))
    }

    /// A socket of CAN frames at a path; where none is given, at one of its own.
    ///
    /// # Errors
    /// It cannot be made: a sentence.
    pub fn socket(at: Option<&Path>) -> Result<(Wire, PathBuf), String> {
        let own = std::env::temp_dir().join(format!("backdrive-can-{}", std::process::id()));
        let path = at.map_or(own, Path::to_path_buf);
        let is_socket = std::fs::symlink_metadata(&path).is_ok_and(|there| {
            use std::os::unix::fs::FileTypeExt;
            there.file_type().is_socket()
        });
        if is_socket {
            // One that an emulator before left behind.
            std::fs::remove_file(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        }
        let socket = UnixDatagram::bind(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        socket.set_nonblocking(true).map_err(|e| e.to_string())?;
        Ok((Wire::Socket(socket, None, path.clone()), path))
    }

    /// What to wait for.
    pub fn fd(&self) -> Option<BorrowedFd<'_>> {
        match self {
            Wire::Pty(ours, _) => Some(ours.as_fd()),
            Wire::Socket(socket, ..) => Some(socket.as_fd()),
            Wire::Pulled => None,
        }
    }

    /// Takes what has arrived.
    pub fn take(&mut self, into: &mut Vec<u8>) -> Arrived {
        let mut bytes = [0u8; 1024];
        let taken = match self {
            Wire::Pty(ours, _) => match read(ours.as_fd(), &mut bytes) {
                Ok(n) => n,
                Err(Errno::EIO) => return Arrived::Nobody,
                Err(_) => return Arrived::Nothing,
            },
            Wire::Socket(socket, from, _) => match socket.recv_from(&mut bytes) {
                Ok((n, sender)) => {
                    *from = Some(sender);
                    n
                }
                Err(_) => return Arrived::Nothing,
            },
            Wire::Pulled => return Arrived::Nothing,
        };
        into.extend_from_slice(&bytes[..taken]);
        Arrived::Bytes(taken)
    }

    /// Sends; how many bytes went. A reader that does not read loses them, as on a real port.
    pub fn send(&mut self, bytes: &[u8]) -> usize {
        match self {
            Wire::Pty(ours, _) => write(ours.as_fd(), bytes).unwrap_or(0),
            Wire::Socket(socket, Some(to), _) => match to.as_pathname().map(|path| socket.send_to(bytes, path)) {
                Some(Ok(n)) => n,
                Some(Err(e)) if e.kind() == ErrorKind::ConnectionRefused => 0,
                Some(Err(_)) | None => 0,
            },
            Wire::Socket(_, None, _) | Wire::Pulled => 0,
        }
    }

    /// Pulls the cable.
    pub fn pull(&mut self) {
        if let Wire::Socket(_, _, path) = self {
            let _ = std::fs::remove_file(path);
        }
        *self = Wire::Pulled;
    }
}

impl Drop for Wire {
    fn drop(&mut self) {
        if let Wire::Socket(_, _, path) = self {
            let _ = std::fs::remove_file(path);
        }
    }
}
