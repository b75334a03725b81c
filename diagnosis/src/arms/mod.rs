//! Which joint of an arm does what its model leaves out, from logs of position, velocity and torque of every joint.
//!
//! [`problem::Problem`] is a model with a robot and its logs. [`diagnose::diagnose`] regresses the measured torque on the torque that the measured motion
//! takes ([`regression`]: inertial parameters, friction and the rest, all through the same filter). It searches for the effects that predict held-out
//! segments of the logs ([`search`]), and simulates the arm in closed loop with and without them ([`judge`]). The result is the same verdict file as for a
//! diagnosis of one axis ([`verdict`]).
//!
//! How it works and where it should not be trusted: docs/arms.md, "Diagnosis of an arm".

pub mod audit;
pub mod base;
pub mod consistent;
mod coupled;
pub mod diagnose;
pub mod drawn;
pub mod error;
pub mod excitation;
pub mod experiment;
pub mod fit;
pub mod gram;
pub mod inertial;
mod joint_by_joint;
mod joint_laws;
pub mod judge;
mod known;
pub mod layout;
mod local;
pub mod log;
pub mod motion;
mod offers;
mod one_load;
mod passive;
pub mod physics;
pub mod place;
pub mod problem;
pub mod regression;
pub mod remaining_residual;
pub mod rigid;
pub mod search;
pub mod sentences;
pub mod soft;
pub mod stated;
mod sure;
pub mod system;
pub mod usable;
pub mod verdict;
pub mod weighing;
pub mod written;

pub use error::ArmError;
