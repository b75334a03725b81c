//! Processes around the cores, and the transports between them.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod book;
pub mod build;
pub mod clock;
pub mod graph;
pub mod histogram;
mod impair;
mod input;
pub mod process;
pub mod protocol;
pub mod realtime;
pub mod recorder;
pub mod runner;
mod sentences;
pub mod sequence;
pub mod stage;
pub mod transport;
