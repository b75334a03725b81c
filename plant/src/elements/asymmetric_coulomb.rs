//! Coulomb friction that depends on the direction.

use super::{FrictionLevels, Kind, Law, Mechanics, Parameter, Range, Role};

/// `f = positive` for `v > 0`, `-negative` for `v < 0`, anything between at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct AsymmetricCoulomb {
    /// N, for `v > 0`.
    pub positive: f64,
    /// N, for `v < 0`.
    pub negative: f64,
}

impl AsymmetricCoulomb {
    pub(super) const KIND: Kind = Kind {
        name: "asymmetric_coulomb",
        equation: "f = c+ for v > 0, -c- for v < 0, set-valued at rest",
        source: "Coulomb",
        energy: "takes, creates none",
        parameters: &[
            Parameter::number("positive", "N", Range::NonNegative, "c+"),
            Parameter::number("negative", "N", Range::NonNegative, "c-"),
        ],
        build: |v| Ok(Law::AsymmetricCoulomb(AsymmetricCoulomb { positive: v[0][0], negative: v[1][0] })),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.positive], vec![self.negative]]
    }
}

impl Mechanics for AsymmetricCoulomb {
    fn role(&self) -> Role {
        Role::Friction(FrictionLevels::constant(self.positive, self.negative))
    }
}
