//! An effect that a model may lack, at a place where it could act, as a change to the model.
//!
//! What is known of each effect stands in its own file in [`crate::physics`]; here is what they are made of.

mod apply;
pub(crate) mod builder;
mod condensed;
mod scales;
pub(crate) mod sites;
mod starts;
mod types;

pub use apply::apply_edits;
pub use scales::{Run, Scales, Span};
pub(crate) use sites::is_seen;
pub(crate) use starts::{inherited, refined, starts_beside};
pub use types::{Against, Facts, Family, Hypothesis, HypothesisError, Mark, Parameter, Physics, Place, State};
pub(crate) use types::{Seen, Span as ForceSpan};
