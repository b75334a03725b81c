//! Everything that does not change while a model moves.

use super::constraints::Constraints;
use super::points::Points;
use super::slots::{Columns, Slots, Square};
use super::sparse::Sparse;
use crate::elements::Linear;

/// What an element has become.
#[derive(Debug, Clone, Copy)]
pub(super) enum Share {
    /// Part of the matrices, between two places.
    Linear(Linear, usize, usize),
    /// Index among the friction contacts.
    Friction(usize),
    /// Index among the path elements.
    Path(usize),
}

/// Everything that does not change while a model moves.
#[derive(Debug, Clone)]
pub(super) struct Compiled {
    /// Place of each body of the model.
    pub(super) slots: Vec<usize>,
    pub(super) free: usize,
    pub(super) prescribed: usize,
    /// Places of a robot's points, behind the free ones.
    pub(super) points: Points,
    pub(super) mass: Square,
    pub(super) damping: Square,
    pub(super) stiffness: Square,
    /// Constant force onto each place, N.
    pub(super) constant: Slots,
    /// Inverse of the free bodies' inertia, 1/kg; of a robot only where it begins.
    pub(super) inverse_mass: Columns,
    /// Share θ of the implicit rule in the position.
    pub(super) theta: f64,
    /// Half the velocity change from: force, position, velocity of the free bodies.
    pub(super) from_force: Columns,
    pub(super) from_position: Columns,
    pub(super) from_velocity: Columns,
    /// The same equations where the network is large.
    pub(super) sparse: Option<Sparse>,
    /// The same from mean position, mean velocity and mean acceleration of each prescribed body.
    pub(super) from_prescribed: Vec<[Slots; 3]>,
    pub(super) elements: Vec<Share>,
    pub(super) constraints: Constraints,
}
