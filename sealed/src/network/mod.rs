//! Nominal models as data: what a `model.toml` and a grip say, names resolved, nothing computed.

pub(crate) mod allowed;
mod data;
mod grip;
mod read;
pub(crate) mod section;

pub use crate::effects::site::GROUND;
pub use data::{Axis, Body, Element, Hold, Input, InputKind, Named, Network, Output, OutputKind, Place};
pub use grip::Grip;
pub use section::NetworkError;
