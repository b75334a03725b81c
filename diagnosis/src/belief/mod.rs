//! What is claimed, and how surely: which structure is chosen, what else explains as much, and the probability that a finding is right.

pub mod beaten;
pub mod choice;
pub mod compare;
pub mod confidence;
pub mod contenders;
pub mod decision;
pub mod evidence;
pub mod intervals;
pub mod on_forces;
pub mod parameters;
pub mod per_record;
pub(crate) mod plausible;
pub mod predictive;
pub mod released_parameters;
pub mod statistics;
