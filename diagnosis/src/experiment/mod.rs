//! The next experiment: which excitation would tell explanations apart that the recordings do not, and how well.
//!
//! Two structures that fit alike are rivals. An experiment separates them by the remaining difference of their predictions when each adapts its own
//! parameters to the other, as far as the recordings allow. This is T-optimality (Hunter and Reiner 1965, Technometrics 7, 307-323), with the recordings'
//! information included as in a sequential design. Of the excitations within the range of the recordings (`menu.rs`) the one is taken that separates the
//! worst pair best per second. Separation counts in standard deviations: the root of the cost that the wrong rival would have above the right one.
//!
//! Where no excitation separates them, a further sensor that would is part of the experiment.
//!
//! Of two laws of which one contains the other, the richer one can always imitate the simpler one. They are separated where the simpler one cannot imitate
//! the prediction of the richer one as fitted.

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
pub use separate::{confirm, separate};
pub use types::{Experiment, NewSensor, Reason};
