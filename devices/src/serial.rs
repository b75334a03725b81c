//! A serial port or a pty, raw: bytes out, bytes in until a deadline.

use crate::bus::BusError;
use nix::errno::Errno;
use nix::fcntl::{Flock, FlockArg, OFlag, open};
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::stat::Mode;
use nix::sys::termios::{BaudRate, FlushArg, SetArg, cfmakeraw, cfsetspeed, tcflush, tcgetattr, tcsetattr};
use nix::sys::time::TimeSpec;
use nix::unistd::{read, write};
use std::os::fd::{AsFd, OwnedFd};
use std::path::Path;
use std::time::{Duration, Instant};

/// Baud rates that Linux has by name.
pub const BAUDS: &[(u32, BaudRate)] = &[
    (9_600, BaudRate::B9600),
    (19_200, BaudRate::B19200),
    (38_400, BaudRate::B38400),
    (57_600, BaudRate::B57600),
    (115_200, BaudRate::B115200),
    (230_400, BaudRate::B230400),
    (460_800, BaudRate::B460800),
    (500_000, BaudRate::B500000),
    (576_000, BaudRate::B576000),
    (921_600, BaudRate::B921600),
    (1_000_000, BaudRate::B1000000),
    (1_500_000, BaudRate::B1500000),
    (2_000_000, BaudRate::B2000000),
    (3_000_000, BaudRate::B3000000),
    (4_000_000, BaudRate::B4000000),
];

/// An open port.
#[derive(Debug)]
pub struct Port {
    name: String,
    fd: Flock<OwnedFd>,
    baud: u32,
}

/// Time of `bytes` on a wire at `baud`: a start bit, eight bits and a stop bit each.
pub fn wire_time(bytes: usize, baud: u32) -> Duration {
    Duration::from_secs_f64(bytes as f64 * 10.0 / f64::from(baud.max(1)))
}

impl Port {
    /// Opens a port for this process alone.
    ///
    /// # Errors
    /// It cannot be opened, another process has it, or it does not take this baud rate.
    pub fn open(path: &Path, baud: u32) -> Result<Port, BusError> {
        let name = path.display().to_string();
        let wrong = |what: String| BusError::Port { port: name.clone(), what };
        let speed = BAUDS.iter().find(|(b, _)| *b == baud).map(|(_, speed)| *speed);
        let speed = speed.ok_or_else(|| {
            let known: Vec<String> = BAUDS.iter().map(|(b, _)| b.to_string()).collect();
            wrong(format!("no baud rate of {baud}; known are {}", known.join(", ")))
        })?;
        let fd = open(path, OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_NONBLOCK | OFlag::O_CLOEXEC, Mode::empty()).map_err(|e| {
            wrong(match e {
                Errno::ENOENT => "no such port; is it plugged in? `ls /dev/ttyACM* /dev/ttyUSB*` lists what is".to_string(),
                Errno::EACCES => "no permission; `sudo usermod -aG dialout $USER`, then log in again".to_string(),
                e => format!("cannot be opened: {}", e.desc()),
            })
        })?;
        let fd = Flock::lock(fd, FlockArg::LockExclusiveNonblock)
            .map_err(|_| wrong("another program has it; two of them would disturb each other's bytes".to_string()))?;
        let mut settings = tcgetattr(fd.as_fd()).map_err(|e| wrong(format!("is no serial port ({})", e.desc())))?;
        cfmakeraw(&mut settings);
        cfsetspeed(&mut settings, speed).map_err(|e| wrong(format!("does not take {baud} baud ({})", e.desc())))?;
        tcsetattr(fd.as_fd(), SetArg::TCSANOW, &settings).map_err(|e| wrong(format!("does not take its settings ({})", e.desc())))?;
        let _ = tcflush(fd.as_fd(), FlushArg::TCIOFLUSH);
        Ok(Port { name, fd, baud })
    }

    /// Its path.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its baud rate.
    pub fn baud(&self) -> u32 {
        self.baud
    }

    /// Sends all of the bytes.
    ///
    /// # Errors
    /// The port is gone, or takes nothing for 100 ms.
    pub fn send(&mut self, mut bytes: &[u8]) -> Result<(), BusError> {
        let deadline = Instant::now() + Duration::from_millis(100);
        while !bytes.is_empty() {
            match write(self.fd.as_fd(), bytes) {
                Ok(n) => bytes = &bytes[n..],
                Err(Errno::EAGAIN) => {
                    if !wait(&self.fd, PollFlags::POLLOUT, deadline) {
                        return Err(self.gone("takes no bytes"));
                    }
                }
                Err(Errno::EINTR) => {}
                Err(e) => return Err(self.gone(e.desc())),
            }
        }
        Ok(())
    }

    /// Appends what arrives until the deadline, as soon as something does; `false` where nothing did.
    ///
    /// # Errors
    /// The port is gone.
    pub fn receive(&mut self, into: &mut Vec<u8>, deadline: Instant) -> Result<bool, BusError> {
        let mut bytes = [0u8; 512];
        loop {
            match read(self.fd.as_fd(), &mut bytes) {
                Ok(0) => return Err(self.gone("was closed at its other end")),
                Ok(n) => {
                    into.extend_from_slice(&bytes[..n]);
                    return Ok(true);
                }
                Err(Errno::EAGAIN) => {
                    if !wait(&self.fd, PollFlags::POLLIN, deadline) {
                        return Ok(false);
                    }
                }
                Err(Errno::EINTR) => {}
                Err(e) => return Err(self.gone(e.desc())),
            }
        }
    }

    /// Forgets what has arrived; how many bytes that was.
    ///
    /// # Errors
    /// The port is gone.
    pub fn discard(&mut self) -> Result<usize, BusError> {
        let mut old = Vec::new();
        while old.len() < 1 << 16 && self.receive(&mut old, Instant::now())? {}
        Ok(old.len())
    }

    fn gone(&self, what: &str) -> BusError {
        BusError::Port { port: self.name.clone(), what: format!("the port is gone ({what})") }
    }
}

/// Waits until the port is ready, or the deadline; `false` at the deadline.
fn wait(fd: &Flock<OwnedFd>, flags: PollFlags, deadline: Instant) -> bool {
    let left = deadline.saturating_duration_since(Instant::now());
    if left.is_zero() {
        return false;
    }
    let mut fds = [PollFd::new(fd.as_fd(), flags)];
    // An interrupted wait is repeated by the caller: it looks at the deadline again.
    !matches!(ppoll(&mut fds, Some(TimeSpec::from_duration(left)), None), Ok(0))
}
