//! Places in the state arrays, and how many there are.

use std::ops::{Index, IndexMut};

/// Bodies, at most.
pub const MAX_BODIES: usize = 64;
/// Elements, at most.
pub const MAX_ELEMENTS: usize = 256;

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

/// A square matrix, column by column: `columns[j][i]` is what a unit at free body j does to free body i. It has as many columns as there are free bodies,
/// so that those of a small network lie close together.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    size: usize,
    values: Vec<f64>,
}

impl Columns {
    /// Zeros.
    pub(super) fn new(size: usize) -> Columns {
        Columns { size, values: vec![0.0; size * size] }
    }

    /// How many columns there are.
    pub(super) fn size(&self) -> usize {
        self.size
    }

    pub(super) fn fill(&mut self, value: f64) {
        self.values.fill(value);
    }

    pub(super) fn swap(&mut self, a: usize, b: usize) {
        if a != b {
            for i in 0..self.size {
                self.values.swap(a * self.size + i, b * self.size + i);
            }
        }
    }

    /// One column to be changed by another.
    pub(super) fn with(&mut self, changed: usize, by: usize) -> (&mut [f64], &[f64]) {
        let n = self.size;
        if changed < by {
            let (head, tail) = self.values.split_at_mut(by * n);
            (&mut head[changed * n..(changed + 1) * n], &tail[..n])
        } else {
            let (head, tail) = self.values.split_at_mut(changed * n);
            (&mut tail[..n], &head[by * n..(by + 1) * n])
        }
    }
}

impl Index<usize> for Columns {
    type Output = [f64];

    #[inline]
    fn index(&self, column: usize) -> &[f64] {
        &self.values[column * self.size..(column + 1) * self.size]
    }
}

impl IndexMut<usize> for Columns {
    #[inline]
    fn index_mut(&mut self, column: usize) -> &mut [f64] {
        &mut self.values[column * self.size..(column + 1) * self.size]
    }
}
