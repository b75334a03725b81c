//! A joint of the network, ready to step.

use crate::laws::ForceLaw;
use crate::network::Place;
use std::ops::Range;

/// A joint of the network, ready to step.
pub(super) struct Joint {
    pub(super) between: [Place; 2],
    pub(super) force: Box<dyn ForceLaw>,
    pub(super) memory: Range<usize>,
    /// Elements whose forces load its friction, each with its sign.
    pub(super) loaded_by: Vec<(usize, f64)>,
    /// m, where its memory stands.
    pub(super) last: f64,
    /// N, what its path sets in this substep.
    pub(super) path_force: f64,
    /// N s/m, in this substep.
    pub(super) damping: f64,
    /// Index among the dry joints.
    pub(super) dry: Option<usize>,
}

impl Joint {
    pub(super) fn relative(&self, values: &[f64]) -> f64 {
        self.between[0].map_or(0.0, |body| values[body]) - self.between[1].map_or(0.0, |body| values[body])
    }

    /// Adds the force `f` (N), positive when stretched, to the bodies' forces.
    pub(super) fn push(&self, f: f64, forces: &mut [f64]) {
        if let Some(body) = self.between[0] {
            forces[body] -= f;
        }
        if let Some(body) = self.between[1] {
            forces[body] += f;
        }
    }
}
