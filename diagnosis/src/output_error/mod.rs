//! Structures simulated on recordings, and fitted to them by what the simulation leaves.

pub mod candidate;
pub mod coupling;
mod derivatives;
pub mod effort;
pub mod error_budget;
pub mod evaluator;
pub mod fit;
pub mod hold;
pub(crate) mod normal_equations;
pub(crate) mod observed;
pub mod simulate;
pub mod structure;
pub mod work;
