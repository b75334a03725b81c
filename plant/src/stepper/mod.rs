//! A model in motion: compiles a [`Model`](crate::model::Model) to a stepper that advances by one sample period at a time.
//!
//! - Springs, dampers, inerters and biases are constant matrices, factored once. Over a substep h the
//!   velocity changes by `2 δ`, `(2M/h + D + θ h K/2) δ = F - K (x + h v/2) - D v`, and the position by the mean
//!   velocity. θ = 1 is the implicit midpoint rule. θ = 1/3 gives every undamped mode its frequency to fourth
//!   order and is taken where the substep resolves the fastest one.
//! - A model of such elements alone is advanced by its exact propagator instead (`exact.rs`).
//! - Dry friction is a box-constrained multiplier on the velocity at the end of the substep (Moreau 1988, Jean 1999), solved for all contacts at
//!   once. A sticking contact has velocity 0, not a small one (`constraints.rs`).
//! - Hysteresis is advanced along its path by the kind's own update. An element that is too stiff for the substep
//!   joins the friction contacts in their implicit solution.
//! - Points of a robot's links are places whose motion is that of the joints (`points.rs`). Linear elements at a point act along its path.
//! - A robot's links add an inertia that changes with their pose, Coriolis forces and gravity to the bodies that are its joints (`links.rs`).

mod account;
mod advance;
mod ahead;
mod at_once;
mod carry;
mod compile;
mod compiled;
mod constraints;
mod contact;
mod dense;
mod drive;
mod endpoint;
mod energy;
mod error;
mod exact;
mod follow;
mod instant;
mod links;
mod motion;
mod options;
mod path;
mod points;
mod propagator;
mod segment;
mod sense;
mod sensor;
mod simulate;
mod slots;
mod sparse;
mod spline;
mod state;
mod sticking;
mod swap;
mod tangents;

pub use ahead::ahead;
pub use energy::Energy;
pub use error::CompileError;
pub use options::Options;
pub use segment::Segment;
pub use simulate::simulate;
pub use slots::{MAX_BODIES, MAX_ELEMENTS};
pub use spline::segments;
pub use state::Plant;
pub use tangents::{LANES, Tangents};
