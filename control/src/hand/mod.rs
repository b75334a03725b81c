//! How firmly the hand holds, estimated while the loop runs, and the induced motion that this hand leaves.
//!
//! `bank.rs` runs the master's model once for each of several grips, all under the force that is applied. `estimate.rs` finds which of them, or which
//! interpolation between two neighbours, moves as the master does, with its uncertainty. `scheduled.rs` predicts the induced motion with only the
//! certain part of it. docs/canceller.md derives what share is safe.

mod bank;
mod estimate;
mod filter;
mod scheduled;
#[cfg(test)]
mod tests;

pub use bank::{HandBank, HandSettings};
pub use estimate::{Estimate, HandEstimator};
pub use scheduled::Scheduled;
