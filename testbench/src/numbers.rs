//! A bench in numbers.

use backdrive_control::dynamometer::DynamometerModel;
use backdrive_control::engine::Engine;
use backdrive_control::observer::Shaft;

/// A bench in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Bench {
    /// Inertias, stiffness, damping.
    pub shaft: Shaft,
    /// Map and lag.
    pub engine: Engine,
    /// Map and linear part.
    pub dynamometer: DynamometerModel,
}
