//! Rings of processes: a message goes from one to the next until it is back where it began.
#![allow(dead_code)]

pub mod children;
pub mod iceoryx2_ring;
pub mod pipes;
pub mod stopwatch;
pub mod supervised;

pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;
