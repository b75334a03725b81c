//! Forces and accelerations at an instant.

use super::slots::{Columns, MAX_ELEMENTS, SLOTS, Slots};

/// An instant.
#[derive(Debug, Clone)]
pub(super) struct Endpoint {
    /// m/s².
    pub(super) acceleration: Slots,
    /// Of each friction contact, N.
    pub(super) friction: [f64; MAX_ELEMENTS],
    /// Of each path element, N.
    pub(super) path: [f64; MAX_ELEMENTS],
    /// Space for the inverse of a robot's inertia.
    pub(super) inverse: Columns,
}

impl Endpoint {
    pub(super) fn new() -> Endpoint {
        Endpoint { acceleration: [0.0; SLOTS], friction: [0.0; MAX_ELEMENTS], path: [0.0; MAX_ELEMENTS], inverse: Columns::default() }
    }
}
