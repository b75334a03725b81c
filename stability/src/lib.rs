//! Is the loop stable at this gain? Answers from what a run or a replay did.

pub mod oscillation;
pub mod outcome;
pub mod session;
