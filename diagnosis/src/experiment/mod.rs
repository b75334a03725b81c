//! The next experiment: which excitation would tell explanations apart that the recordings do not, and how well.
//!
//! Two structures that fit alike are rivals. An experiment separates them by what is left of the difference of their predictions
//! when each may move its own numbers to imitate the other, as far as the recordings let them (T-optimality, Hunter and Reiner
//! 1965, Technometrics 7, 307-323; with the recordings' information as it stands in a sequential design). Of the excitations
//! within what the device was shown to stand (`menu.rs`) the one is taken that gives most for the worst pair per second. What is
//! left counts in standard deviations: the root of the cost that the wrong rival would have above the right one.
//!
//! Where no excitation separates them, the sensor is named that would.

mod determine;
mod extra_output;
mod menu;
mod planner;
mod rivals;
mod sensor;
mod separate;
mod setup;
#[cfg(test)]
mod tests;
mod types;
mod words;

pub use determine::excite;
pub use separate::separate;
pub use types::{Experiment, Reason, WANTED};
