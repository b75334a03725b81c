//! An emulator: bytes are taken, answered, and paced at the baud rate, while the plants run in real time.

use super::dynamixel::DynamixelServos;
use super::emulated::Emulated;
use super::faults::{Fault, Faults};
use super::feetech::FeetechServos;
use super::file::EmulatorFile;
use super::mit::MitMotors;
use super::servo::Servo;
use super::speaker::Speaker;
use super::wire::{Arrived, Wire};
use crate::file::Protocol;
use backdrive_control::device::DeviceError;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Why an emulator does not run.
#[derive(Debug, thiserror::Error)]
pub enum EmulatorError {
    /// A plant does not work as a servo's.
    #[error("servo {id}: {error}")]
    Plant {
        /// The servo.
        id: u32,
        /// What is wrong.
        error: DeviceError,
    },
    /// The machine gives no pty or no socket.
    #[error("no port can be opened: {0}")]
    Port(String),
    /// The link cannot be made.
    #[error("{path}: the link to the port cannot be made: {error}")]
    Link {
        /// The link.
        path: String,
        /// Why.
        error: std::io::Error,
    },
}

/// A bus of emulated servos.
pub struct Emulator {
    speaker: Box<dyn Speaker>,
    wire: Wire,
    port: PathBuf,
    link: Option<PathBuf>,
    faults: Faults,
    /// Time of a byte on the wire, s.
    byte_s: f64,
    latency: Duration,
    period: Duration,
    heard: Vec<u8>,
    /// Answers that wait for their time.
    coming: VecDeque<(Instant, Vec<u8>)>,
    /// Time until which the wire is busy.
    busy_until: Instant,
    /// Bytes that were taken and sent.
    carried: [u64; 2],
}

/// Delay of an answer that is late.
const LATE: Duration = Duration::from_millis(20);
/// A simulation that is behind by more than this skips the rest.
const MOST_BEHIND: Duration = Duration::from_millis(500);

impl Emulator {
    /// Opens the port, and links to it where a link is asked for. A socket of CAN frames lies at the link itself.
    ///
    /// # Errors
    /// A plant does not work, or the machine gives no port or no link.
    pub fn open(file: &EmulatorFile, faults: Faults, link: Option<&Path>) -> Result<Emulator, EmulatorError> {
        let servos = file.servos.iter().enumerate().map(|(index, servo)| {
            let seed = file.seed.wrapping_mul(31).wrapping_add(index as u64);
            Servo::new(servo.clone(), file.loop_hz, seed).map_err(|error| EmulatorError::Plant { id: servo.id, error })
        });
        let servos = servos.collect::<Result<Vec<_>, _>>()?;
        let speaker: Box<dyn Speaker> = match file.protocol {
            Protocol::FeetechSts | Protocol::FeetechScs => Box::new(FeetechServos::new(servos, file.protocol)),
            Protocol::Dynamixel2 => Box::new(DynamixelServos::new(servos)),
            Protocol::Mit => Box::new(MitMotors::new(servos)),
        };
        let is_can = file.protocol == Protocol::Mit;
        let (wire, port) = if is_can { Wire::socket(link) } else { Wire::pty() }.map_err(EmulatorError::Port)?;
        let link = link.filter(|_| !is_can);
        if let Some(link) = link {
            linked(&port, link)?;
        }
        Ok(Emulator {
            byte_s: speaker.bits_per_byte() / f64::from(file.baud),
            speaker,
            wire,
            port,
            link: link.map(Path::to_path_buf),
            faults,
            latency: Duration::from_secs_f64(file.latency_s),
            period: Duration::from_secs_f64(1.0 / file.loop_hz),
            heard: Vec::new(),
            coming: VecDeque::new(),
            busy_until: Instant::now(),
            carried: [0; 2],
        })
    }

    fn wire_time(&self, bytes: usize) -> Duration {
        Duration::from_secs_f64(bytes as f64 * self.byte_s)
    }

    fn hear(&mut self, at_s: f64) {
        loop {
            match self.wire.take(&mut self.heard) {
                Arrived::Bytes(n) => {
                    self.carried[0] += n as u64;
                    // The port is faster than a wire: its time is added here.
                    self.busy_until = self.busy_until.max(Instant::now()) + self.wire_time(n);
                }
                Arrived::Nobody => {
                    std::thread::sleep(Duration::from_millis(1));
                    return;
                }
                Arrived::Nothing => return,
            }
            for answer in self.speaker.answers(&mut self.heard) {
                self.answer(answer, at_s);
            }
        }
    }

    /// Puts an answer on the wire, with what goes wrong there.
    fn answer(&mut self, mut bytes: Vec<u8>, at_s: f64) {
        let fault = self.faults.next(at_s);
        self.busy_until = self.busy_until.max(Instant::now()) + self.latency + self.wire_time(bytes.len());
        let mut due = self.busy_until;
        let mut copies = 1;
        match fault {
            Some(Fault::Silent) => return,
            Some(Fault::Corrupt) => {
                let at = self.faults.any_of(bytes.len());
                bytes[at] ^= 1 << self.faults.any_of(8);
                // CAN checks its frames itself: a broken one is not seen at all.
                if matches!(self.wire, Wire::Socket(..)) {
                    return;
                }
            }
            Some(Fault::Late) => due += LATE,
            Some(Fault::Twice) => copies = 2,
            Some(Fault::OtherId) => self.speaker.of_another(&mut bytes),
            Some(Fault::Checksum) => {
                if !self.speaker.spoilt(&mut bytes) {
                    return;
                }
            }
            Some(Fault::Closed) | None => {}
        }
        for _ in 0..copies {
            let at = self.coming.iter().position(|(other, _)| *other > due).unwrap_or(self.coming.len());
            self.coming.insert(at, (due, bytes.clone()));
        }
    }

    fn send_due(&mut self, now: Instant) {
        while self.coming.front().is_some_and(|(due, _)| *due <= now) {
            let Some((_, bytes)) = self.coming.pop_front() else { return };
            self.carried[1] += self.wire.send(&bytes) as u64;
        }
    }
}

impl Emulated for Emulator {
    fn port(&self) -> &Path {
        &self.port
    }

    fn faults(&self) -> Vec<(&'static str, u64)> {
        self.faults.counts()
    }

    fn carried(&self) -> [u64; 2] {
        self.carried
    }

    fn run(&mut self, ended: &mut dyn FnMut() -> bool) {
        // Timers are otherwise late by 50 us, half of an answer.
        let _ = nix::sys::prctl::set_timerslack(1);
        let begun = Instant::now();
        let mut next = begun + self.period;
        loop {
            let now = Instant::now();
            self.send_due(now);
            if now >= next {
                if ended() {
                    return;
                }
                if now - next > MOST_BEHIND {
                    next = now;
                }
                self.speaker.servos().iter_mut().for_each(Servo::step);
                next += self.period;
                continue;
            }
            let at_s = (now - begun).as_secs_f64();
            if !matches!(self.wire, Wire::Pulled) && self.faults.closes(at_s) {
                self.wire.pull();
                self.coming.clear();
            }
            let due = self.coming.front().map_or(next, |(at, _)| (*at).min(next));
            let left = due.saturating_duration_since(Instant::now());
            let Some(fd) = self.wire.fd() else {
                std::thread::sleep(left);
                continue;
            };
            let mut fds = [PollFd::new(fd, PollFlags::POLLIN)];
            let ready = ppoll(&mut fds, Some(TimeSpec::from_duration(left)), None);
            if matches!(ready, Ok(n) if n > 0) {
                self.hear(at_s);
            }
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        if let Some(link) = &self.link
            && std::fs::read_link(link).is_ok_and(|there| there == self.port)
        {
            let _ = std::fs::remove_file(link);
        }
    }
}

/// Links to the port. What lies there already is replaced only where it is a link.
fn linked(port: &Path, link: &Path) -> Result<(), EmulatorError> {
    let wrong = |error| EmulatorError::Link { path: link.display().to_string(), error };
    if std::fs::symlink_metadata(link).is_ok_and(|there| there.is_symlink()) {
        std::fs::remove_file(link).map_err(wrong)?;
    }
    std::os::unix::fs::symlink(port, link).map_err(wrong)
}
