//! Joints that a position servo drives: how they answer their commands, found from commands and positions without torque.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod diagnose;
pub mod error;
pub mod fit;
pub mod gravity;
pub mod inputs;
pub mod physics;
pub mod problem;
pub mod record;
pub mod refit;
pub mod run;
pub mod search;
pub mod sentences;
pub mod shared;
pub mod simulate;
