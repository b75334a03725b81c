//! Where model and recording part, and which effects the model lacks.
//!
//! [`problem::Problem`] is a nominal model and its recordings, and [`fit`] refits a structure by simulation error. A [`hypothesis::Hypothesis`] is an
//! effect at a place, and [`search`] finds which hypotheses the recordings require. [`verdict`] gives the result as a file and a model.
//! [`diagnose::diagnose`] does all of it.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod audit;
pub(crate) mod beginnings;
pub mod candidate;
pub mod compare;
pub mod contenders;
pub(crate) mod coupled;
pub mod coupling;
mod derivatives;
pub mod diagnose;
pub mod document;
pub mod effort;
pub mod equation_error;
pub mod error_budget;
pub mod evaluator;
pub mod evidence;
pub mod excerpts;
pub mod experiment;
pub mod fit;
pub mod follow;
pub mod hold;
pub mod hypothesis;
pub mod intervals;
pub mod kinematics;
pub mod locate;
pub mod noise;
pub(crate) mod normal_equations;
pub mod parameters;
pub mod per_record;
pub mod physics;
pub mod predictive;
pub mod problem;
pub mod race;
pub mod released_parameters;
pub mod repeatability;
pub mod screen;
pub mod search;
pub mod signal;
pub mod simulate;
pub mod statistics;
pub mod structure;
pub(crate) mod thinned;
pub mod tuning;
pub mod unknown;
pub mod verdict;
pub mod words;
pub mod work;
