//! The reports of a bench.

use super::compare::Comparison;
use super::world::World;
use backdrive_testbench::{Identified, Record, Validation};

/// A bench from its seed to its figures.
pub(super) struct Reported {
    pub(super) seed: u64,
    pub(super) world: World,
    pub(super) identified: Identified,
    pub(super) steps: Record,
    pub(super) unseen: Record,
    pub(super) dragged: Record,
    pub(super) validation: Validation,
    pub(super) comparison: Comparison,
}
