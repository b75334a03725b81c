//! Runs a graph: starts one process per node, watches them, shows how they do, restarts or stops them,
//! and leaves nothing behind.
//!
//! - `plan`: what the supervisor needs to know of a graph
//! - `rundir`: the directory of a run; `sweep`: removing what dead runs have left
//! - `child`: one process, heard and ended; `slot`: the place of a node in a run, over all its lives
//! - `supervise`: starting and ending a run; `watch`: what happens between
//! - `domain_claim`: which run of a machine speaks in a ROS domain; `session`: who a run is on the network; `secret`: what its hosts share
//! - `hosts`: a run on several hosts starts together; `place`: where its nodes meet
//! - `asked`: from options and the environment to where a run meets; `bridge`: a local run seen over ROS 2; `play`: a bag sent again
//! - `asks`: what may be asked of a run from outside; `alive`: which runs there are
//! - `status`, `screen`: what a person sees meanwhile
//! - `report`: what is known afterwards
//!
//! A run is three things on the machine: its directory, the files `/dev/shm/bd<id>_*`, and its processes.
//! The supervisor holds a lock in the directory for as long as it lives. A run whose lock is free is dead: the last of
//! its processes removes it (`orphaned`), or whoever starts next.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod alive;
pub mod asked;
pub mod asks;
pub mod bridge;
mod carry_error;
mod child;
pub mod doctor;
mod domain_claim;
mod error;
mod hosts;
pub mod join;
mod member;
mod options;
mod orphaned;
mod pace;
mod paths;
mod place;
mod plan;
pub mod play;
mod proc_stat;
mod remains;
mod report;
mod rundir;
mod screen;
pub mod secret;
mod session;
mod signals;
mod slot;
mod status;
pub mod step_program;
mod supervise;
mod sweep;
mod tell;
mod watch;

pub use carry_error::CarryError;
pub use error::LaunchError;
pub use hosts::Begun;
pub use options::{Command, OnDeath, SuperviseOptions};
pub use paths::RunPaths;
pub use place::{Place, Wire};
pub use plan::{NodePlan, Plan};
pub use report::{Cause, Death, NodeReport, RunEvent, RunReport};
pub use rundir::{RunDir, RunHome};
pub use screen::Display;
pub use supervise::{run, supervise, supervise_plan};
pub use sweep::{Swept, SweptRun};
