//! An engine test bench identified from its bags, as Blumenschein et al. (ECC 2013) do it.
//!
//! [`Record`] is what a bag of a bench holds. [`identify`] makes a [`Bench`] of three of them, in the paper's order: static maps, the
//! dynamometer's linear part, J_A, the damping by matching poles, inertia and shaft refined in closed loop, then the engine's torque by the
//! observer and the engine's lag from it. A [`Bench`] simulates itself; [`validate`] gives
//! the correlations that the paper validates with.

mod dynamometer;
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
