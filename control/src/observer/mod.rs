//! The proportional-integral observer with an unknown input: it estimates an unmeasured force or torque from measured motion.
//!
//! Of an engine test bench it estimates the engine's torque (Blumenschein et al. 2013, Section II-B); of a master, the force of the user's hand.
//! [`System`] is eq (2), [`design()`] finds the gains of eq (3) by the Riccati form of the matrix inequality (6), [`lmi`] checks them against that
//! inequality, [`UnknownInput`] is the observer in time. [`ExtendedKalman`] and [`Derivative`] are what it is compared with.

mod derivative;
mod design;
mod extended_kalman;
pub mod lmi;
pub mod riccati;
mod system;
mod unknown_input;
mod weights;

pub use derivative::Derivative;
pub use design::{Design, DesignError, design, kalman, norm_squared};
pub use extended_kalman::{ExtendedKalman, Shaft};
pub use system::{Quantity, System, SystemError};
pub use unknown_input::{ObserverNode, UnknownInput};
pub use weights::Weights;
