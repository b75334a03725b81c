//! Where model and recording part, and which effects the model lacks.
//!
//! [`recordings::problem::Problem`] is a nominal model and its recordings, and [`output_error::fit`] refits a structure by simulation error. A
//! [`hypothesis::Hypothesis`] is an effect at a place, and [`search`] finds which hypotheses the recordings require. [`belief`] decides what is claimed,
//! and [`verdict`] gives the result as a file and a model. [`diagnose::diagnose`] does all of it.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod arms;
pub mod audit;
pub mod belief;
pub mod diagnose;
pub mod equation_error;
pub mod experiment;
pub mod hypothesis;
pub mod locate;
pub mod options;
pub mod output_error;
pub mod physics;
pub mod recordings;
pub mod search;
pub mod tuning;
pub mod verdict;
