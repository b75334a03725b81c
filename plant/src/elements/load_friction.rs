//! Dry friction that grows with the load of a joint.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{FrictionLaw, Linear, Rubbing};
use super::sine::Sine;

/// `f = (force + coefficient |load|) sign(v)`, set-valued at rest; the load is the force of the joint, see [`crate::load`].
///
/// A screw in its nut, a gear's bearing, a cable in its guide: the coefficient holds how the joint's force becomes a normal force. Linearised without
/// load.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadFriction {
    /// N, without load.
    pub force: f64,
    /// Friction per load.
    pub coefficient: f64,
}

impl LoadFriction {
    pub(super) const KIND: KindOf<LoadFriction> = KindOf {
        name: "load_friction",
        equation: "f = (c + μ |load|) sign(v), set-valued at rest; load: force of the joint",
        source: "Coulomb; of cables and screws Euler 1769, of gears Pelchen, Schweiger & Otter 2002",
        energy: "dissipates, creates none",
        parameters: &[
            Parameter::number("force", "N", Range::NonNegative, "c, without load"),
            Parameter::number("coefficient", "-", Range::NonNegative, "μ, friction per force of the joint"),
        ],
        build: |v| Ok(LoadFriction { force: v[0][0], coefficient: v[1][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.force], vec![self.coefficient]]
    }
}

impl FrictionLaw for LoadFriction {
    #[inline]
    fn level(&self, at: &Rubbing) -> f64 {
        self.force + self.coefficient * at.load.abs()
    }

    fn linearised(&self, at: &Sine) -> Linear {
        harmonic::of_friction(self, at)
    }
}
