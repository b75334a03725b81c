//! Processes around the cores, and the transports between them.

pub mod build;
pub mod graph;
pub mod protocol;
pub mod stage;
pub mod transport;
mod book;
pub mod clock;
pub mod histogram;
mod impair;
mod input;
pub mod runner;
mod sentences;
pub mod process;
pub mod realtime;
pub mod recorder;
pub mod sequence;
