//! What every emulator does.

use std::path::Path;

/// An emulator of any bus.
pub trait Emulated {
    /// What a device's file names as its port.
    fn port(&self) -> &Path;
    /// Runs until `ended` gives true; it is asked once a period of the loop inside of the servos.
    fn run(&mut self, ended: &mut dyn FnMut() -> bool);
    /// What went wrong on purpose so far.
    fn faults(&self) -> Vec<(&'static str, u64)>;
    /// Bytes that were taken and sent.
    fn carried(&self) -> [u64; 2];
}
