//! Re-simulation of the loop at another gain, with the models of a bag or exchanged ones, moved by the recorded hand.
//!
//! Friction and hysteresis give limit cycles that no linear test sees. With them the stability limit depends on what the hand does, so every answer
//! is that of a stated script: the bag's own intent, or another graph's operator.

pub mod edge;
pub mod grip;
pub mod grips;
pub mod over_cancelling;
pub mod recover;
mod scenario;
pub mod script;
pub mod sweep;
#[cfg(test)]
mod tests;
mod types;

pub use scenario::{OwnCores, Scenario};
pub use types::{Gain, ResimulateError, Run, RunOptions};
