//! Coulomb friction.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{FrictionLaw, Linear, Rubbing};
use super::sine::Sine;

/// `f = force sign(v)`, any value between `-force` and `force` at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Coulomb {
    /// N.
    pub force: f64,
}

impl Coulomb {
    pub(super) const KIND: KindOf<Coulomb> = KindOf {
        name: "coulomb",
        equation: "f = c sign(v), set-valued at rest",
        source: "Coulomb; as a box-constrained multiplier Moreau 1988, Jean 1999",
        energy: "dissipates, creates none",
        parameters: &[Parameter::number("force", "N", Range::NonNegative, "c")],
        build: |v| Ok(Coulomb { force: v[0][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.force]]
    }
}

impl FrictionLaw for Coulomb {
    #[inline]
    fn level(&self, _at: &Rubbing) -> f64 {
        self.force
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn linearised(&self, at: &Sine) -> Linear {
        harmonic::of_friction(self, at)
    }
}
