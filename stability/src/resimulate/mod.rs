//! The loop run again at another gain, with the models of a bag or swapped ones, moved by the hand that was recorded.
//!
//! Friction and hysteresis give limit cycles that no linear test sees; with them the edge depends on what the hand does, so
//! every answer is that of a stated script: the bag's own intent, or another graph's operator.

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
