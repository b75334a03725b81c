//! Real devices on a graph: buses of servos and motors behind one trait, their files, start-up checks and watchdog, and emulators that speak their bytes.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod bus;
pub mod core;
pub mod driver;
pub mod dynamixel;
pub mod emulator;
pub mod feetech;
pub mod file;
pub mod find;
pub mod mit;
pub mod serial;
pub mod side;
pub mod start;
mod stopwatch;
pub mod survey;
