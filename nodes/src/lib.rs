//! Processes around the cores, and the transports between them.

pub mod protocol;
pub mod stage;
pub mod transport;
