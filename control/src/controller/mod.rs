//! The controller of a slave that is driven by a force: it moves the tip to the commanded position.
//!
//! A law is a pure function of (reference, state) and its own memory: [`pd`], [`sliding_mode`], [`backstepping`], each one a file. What a
//! law knows of the axis, inertia and friction, is a model's ([`axis`]), which need not be the real one.

pub mod axis;
pub mod backstepping;
mod law;
mod node;
pub mod pd;
pub mod reference;
pub mod sliding_mode;
mod types;

pub use axis::{AxisModel, Bristles};
pub use backstepping::Backstepping;
pub use law::{Law, Settings, Working};
pub use node::Controller;
pub use pd::Pd;
pub use reference::{Differentiator, ReferenceFilter};
pub use sliding_mode::SlidingMode;
pub use types::{ControllerError, Feedforward, Reference, State, switching_sign};
