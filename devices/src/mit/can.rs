//! CAN frames: over an interface of the kernel, or over a UNIX socket with the same 16 bytes where the kernel has none.

use crate::bus::BusError;
use nix::libc;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use nix::unistd::{read, write};
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, FromRawFd, OwnedFd};
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Instant;

/// Bytes of a frame as the kernel has it: id, length, padding, data.
pub const FRAME_BYTES: usize = 16;
/// Bits on the wire of a frame of 8 bytes with a short id, without stuffing, and the pause after it.
pub const FRAME_BITS: f64 = 114.0;

/// A frame with a short id and 8 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CanFrame {
    /// Its id, 11 bits.
    pub id: u32,
    /// Its data.
    pub data: [u8; 8],
}

impl CanFrame {
    /// As the kernel has it.
    pub fn bytes(&self) -> [u8; FRAME_BYTES] {
        let mut bytes = [0; FRAME_BYTES];
        bytes[..4].copy_from_slice(&self.id.to_ne_bytes());
        bytes[4] = 8;
        bytes[8..].copy_from_slice(&self.data);
        bytes
    }

    /// `None` where it is no frame of 8 bytes with a short id.
    pub fn of(bytes: &[u8]) -> Option<CanFrame> {
        let bytes: &[u8; FRAME_BYTES] = bytes.try_into().ok()?;
        let id = u32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        let mut data = [0; 8];
        data.copy_from_slice(&bytes[8..]);
        (id <= 0x7ff && bytes[4] == 8).then_some(CanFrame { id, data })
    }
}

/// A CAN bus.
pub enum Can {
    /// An interface of the kernel.
    Interface(OwnedFd, String),
    /// A socket in the file system, and the path of our end.
    Socket(UnixDatagram, String, PathBuf),
}

/// Counts the sockets of this process.
static SOCKETS: AtomicU32 = AtomicU32::new(0);

impl Can {
    /// Opens an interface by its name, such as `can0`, or a socket by its path.
    ///
    /// # Errors
    /// There is none, or it is down.
    pub fn open(port: &Path) -> Result<Can, BusError> {
        let name = port.display().to_string();
        let wrong = |what: String| BusError::Port { port: name.clone(), what };
        if name.contains('/') {
            let number = SOCKETS.fetch_add(1, Ordering::Relaxed);
            let own = std::env::temp_dir().join(format!("backdrive-can-{}-{number}", std::process::id()));
            let _ = std::fs::remove_file(&own);
            let socket = UnixDatagram::bind(&own).map_err(|e| wrong(e.to_string()))?;
            let opened = socket.connect(port).and_then(|()| socket.set_nonblocking(true));
            if let Err(e) = opened {
                let _ = std::fs::remove_file(&own);
                return Err(wrong(format!("no emulator listens there ({e})")));
            }
            return Ok(Can::Socket(socket, name, own));
        }
        let text = std::ffi::CString::new(name.as_bytes()).map_err(|_| wrong("is no name of an interface".to_string()))?;
        // SAFETY: the text lives through the call and ends with a zero.
        let index = unsafe { libc::if_nametoindex(text.as_ptr()) };
        if index == 0 {
            let how = format!("`ip link` lists them, `sudo ip link set {name} up type can bitrate 1000000` starts one");
            return Err(wrong(format!("no such CAN interface; {how}")));
        }
        // SAFETY: plain system calls; the address is a local of the right size, and the descriptor is owned at once.
        let fd = unsafe {
            let raw = libc::socket(libc::PF_CAN, libc::SOCK_RAW | libc::SOCK_NONBLOCK | libc::SOCK_CLOEXEC, libc::CAN_RAW);
            if raw < 0 {
                return Err(wrong(format!("the kernel has no CAN ({})", std::io::Error::last_os_error())));
            }
            OwnedFd::from_raw_fd(raw)
        };
        // SAFETY: all zeros is a valid address of this type.
        let mut address: libc::sockaddr_can = unsafe { std::mem::zeroed() };
        address.can_family = libc::AF_CAN as libc::sa_family_t;
        address.can_ifindex = index as libc::c_int;
        let size = size_of::<libc::sockaddr_can>() as libc::socklen_t;
        // SAFETY: the address lives through the call and has the size that is stated.
        let bound = unsafe { libc::bind(fd.as_raw_fd(), (&raw const address).cast(), size) };
        if bound < 0 {
            return Err(wrong(format!("cannot be used ({})", std::io::Error::last_os_error())));
        }
        Ok(Can::Interface(fd, name))
    }

    /// Its name or path.
    pub fn name(&self) -> &str {
        match self {
            Can::Interface(_, name) | Can::Socket(_, name, _) => name,
        }
    }

    fn fd(&self) -> BorrowedFd<'_> {
        match self {
            Can::Interface(fd, _) => fd.as_fd(),
            Can::Socket(socket, ..) => socket.as_fd(),
        }
    }

    /// Sends a frame.
    ///
    /// # Errors
    /// The bus is gone, or takes nothing.
    pub fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        match write(self.fd(), &frame.bytes()) {
            Ok(FRAME_BYTES) => Ok(()),
            Ok(_) => Err(self.gone("took half a frame")),
            Err(e) => Err(self.gone(e.desc())),
        }
    }

    /// The next frame until the deadline; frames of other forms are passed over.
    ///
    /// # Errors
    /// The bus is gone.
    pub fn receive(&mut self, deadline: Instant) -> Result<Option<CanFrame>, BusError> {
        let mut bytes = [0u8; 64];
        loop {
            match read(self.fd(), &mut bytes) {
                Ok(n) => {
                    if let Some(frame) = CanFrame::of(&bytes[..n]) {
                        return Ok(Some(frame));
                    }
                }
                Err(nix::errno::Errno::EAGAIN) => {
                    let left = deadline.saturating_duration_since(Instant::now());
                    if left.is_zero() {
                        return Ok(None);
                    }
                    let mut fds = [PollFd::new(self.fd(), PollFlags::POLLIN)];
                    let _ = ppoll(&mut fds, Some(TimeSpec::from_duration(left)), None);
                }
                Err(nix::errno::Errno::EINTR) => {}
                Err(e) => return Err(self.gone(e.desc())),
            }
        }
    }

    fn gone(&self, what: &str) -> BusError {
        BusError::Port { port: self.name().to_string(), what: format!("the bus is gone ({what})") }
    }
}

impl Drop for Can {
    fn drop(&mut self) {
        if let Can::Socket(_, _, own) = self {
            let _ = std::fs::remove_file(own);
        }
    }
}
