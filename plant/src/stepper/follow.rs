//! Following a plant through its substeps.

use super::motion::Motion;
use super::state::Plant;

/// Follows a plant through its substeps.
pub(super) trait Follow {
    /// The forces and velocities of a substep are known; positions and memories are still those of its start.
    fn forces(&mut self, plant: &mut Plant, n: usize, motion: &Motion);
    /// The substep is over.
    fn arrived(&mut self, plant: &Plant, n: usize);
    /// Delayed outputs have been noted.
    fn noted(&mut self, plant: &Plant);
}

/// Without a follower.
impl Follow for () {
    #[inline(always)]
    fn forces(&mut self, _: &mut Plant, _: usize, _: &Motion) {}
    #[inline(always)]
    fn arrived(&mut self, _: &Plant, _: usize) {}
    #[inline(always)]
    fn noted(&mut self, _: &Plant) {}
}
