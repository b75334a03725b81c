//! Emulators: the real bytes of a bus of servos on a pty, over simulated plants whose effects a user of the bus does not see.

mod dynamixel;
mod emulated;
mod faults;
mod feetech;
mod file;
mod mit;
mod run;
mod servo;
mod speaker;
mod wire;

pub use emulated::Emulated;
pub use faults::{Fault, FaultError, Faults};
pub use file::{EmulatorFile, ServoFile, Tone};
pub use run::{Emulator, EmulatorError};
pub use servo::{Present, Servo};

use std::path::Path;

/// Opens the emulator of a file.
///
/// # Errors
/// As [`EmulatorError`].
pub fn open(file: &EmulatorFile, faults: Faults, link: Option<&Path>) -> Result<Box<dyn Emulated>, EmulatorError> {
    Ok(Box::new(Emulator::open(file, faults, link)?))
}
