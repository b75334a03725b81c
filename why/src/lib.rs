//! Why does a force-reflecting loop shake, and what would stop it?

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod answer;
pub mod as_recorded;
pub mod cause;
pub mod cause_kind;
pub mod change;
mod coupled;
pub mod device;
pub mod difference;
pub mod differences;
pub mod faulty;
mod fine;
#[cfg(test)]
mod fixtures;
mod follower;
pub mod foreign;
pub mod happening;
pub mod knob;
mod named;
pub mod now;
pub mod options;
pub mod recording;
pub mod remedy;
pub mod seen;
mod stairs;
mod stated;
pub mod throw;
pub mod trial;
pub mod tuned;
