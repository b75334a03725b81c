//! Is the loop stable at this gain? Answers from what a run or a replay did.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod asked;
pub mod bag_gate;
mod bag_rows;
pub mod by_itself;
pub mod collect;
pub mod compare;
pub mod coupling;
pub mod energy;
pub mod frequency;
pub mod from_bag;
mod grid;
pub mod judgement;
mod long_bag;
mod master_run;
mod model_check;
pub mod moving;
pub mod nyquist;
pub mod oscillation;
pub mod outcome;
mod part_check;
mod phases;
pub mod resimulate;
pub mod roles;
mod rosbag;
pub mod sensors;
pub mod session;
mod signal_role;
pub mod spectra;
pub mod summary;
pub mod transparency;
pub mod unjudged;
pub mod verdict;
