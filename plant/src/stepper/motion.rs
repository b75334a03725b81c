//! A substep while it is computed.

use super::slots::{SLOTS, Slots};

/// A substep while it is computed, by place; SI units. Of places that are neither free nor driven by an input only zeros are read.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    /// Mean force on free bodies, N, and what of it the inputs push with.
    pub(super) force: Slots,
    pub(super) pushed: Slots,
    /// Position in the middle, and mean velocity.
    pub(super) middle: Slots,
    pub(super) mean_velocity: Slots,
    /// Position at the end where it is prescribed, of a free body what is added to it; velocity at the end.
    pub(super) end: Slots,
    pub(super) end_velocity: Slots,
}

impl Motion {
    pub(super) fn new() -> Motion {
        let zero = [0.0; SLOTS];
        Motion { force: zero, pushed: zero, middle: zero, mean_velocity: zero, end: zero, end_velocity: zero }
    }
}
