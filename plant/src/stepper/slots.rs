//! Places in the state arrays, and how many there are.

/// Bodies, at most.
pub const MAX_BODIES: usize = 15;
/// Elements, at most.
pub const MAX_ELEMENTS: usize = 64;

/// Places in the state arrays: free bodies from the first on, ground last, those on motion inputs before it, downwards.
pub(super) const SLOTS: usize = MAX_BODIES + 1;
pub(super) const GROUND: usize = SLOTS - 1;

/// Place of the p-th body on a motion input.
pub(super) const fn prescribed_slot(p: usize) -> usize {
    GROUND - 1 - p
}

pub(super) type Slots = [f64; SLOTS];

/// A symmetric matrix over the places.
pub(super) type Square = Box<[Slots; SLOTS]>;
/// `columns[j][i]`: what a unit at free body j does to free body i.
pub(super) type Columns = [Slots; SLOTS];
