//! An engine test bench identified from its bags, as Blumenschein et al. (ECC 2013) do it.
//!
//! [`Record`] is what a bag of a bench holds. [`identify`] makes a [`Bench`] of three of them, in the paper's order: static maps, the dynamometer's
//! linear part, J_A, and the damping by matching poles. Then inertia and shaft are refined in closed loop, and the observer gives the engine's torque
//! and from it the engine's lag. A [`Bench`] simulates itself; [`validate`] gives the correlations that the paper validates with.

mod dynamometer;
pub mod files;
mod fit;
mod identify;
pub mod lag;
mod maps;
mod mechanics;
mod numbers;
mod record;
mod simulate;
mod validate;

pub use identify::{Asked, Identified, identify};
pub use numbers::Bench;
pub use record::{BenchError, Record};
pub use simulate::{Trajectory, closed_loop, open_loop};
pub use validate::{Validation, validate};
