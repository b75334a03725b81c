//! Exams whose truth is simulated.

pub mod drift;
pub mod gate;
mod processor;
