//! What was recorded: the problem that recordings and a model pose, and what the recordings say of themselves.

pub mod follow;
pub mod kinematics;
pub mod noise;
pub(crate) mod observer;
pub mod problem;
pub mod repeatability;
pub mod signal;
pub(crate) mod thinned;
pub mod unknown;
