//! Coulomb friction.

use super::{FrictionLevels, Kind, Law, Mechanics, Parameter, Range, Role};

/// `f = force sign(v)`, any value between `-force` and `force` at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Coulomb {
    /// N.
    pub force: f64,
}

impl Coulomb {
    pub(super) const KIND: Kind = Kind {
        name: "coulomb",
        equation: "f = c sign(v), set-valued at rest",
        source: "Coulomb; as a box-constrained multiplier Moreau 1988, Jean 1999",
        energy: "takes, creates none",
        parameters: &[Parameter::number("force", "N", Range::NonNegative, "c")],
        build: |v| Ok(Law::Coulomb(Coulomb { force: v[0][0] })),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.force]]
    }
}

impl Mechanics for Coulomb {
    fn role(&self) -> Role {
        Role::Friction(FrictionLevels::constant(self.force, self.force))
    }
}
