//! Coulomb friction that depends on the direction.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{FrictionLaw, Linear, Rubbing, Side};
use super::sine::Sine;

/// `f = positive` for `v > 0`, `-negative` for `v < 0`, anything between at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct AsymmetricCoulomb {
    /// N, for `v > 0`.
    pub positive: f64,
    /// N, for `v < 0`.
    pub negative: f64,
}

impl AsymmetricCoulomb {
    pub(super) const KIND: KindOf<AsymmetricCoulomb> = KindOf {
        name: "asymmetric_coulomb",
        equation: "f = c+ for v > 0, -c- for v < 0, set-valued at rest",
        source: "Coulomb",
        energy: "dissipates, creates none",
        parameters: &[
            Parameter::number("positive", "N", Range::NonNegative, "c+"),
            Parameter::number("negative", "N", Range::NonNegative, "c-"),
        ],
        build: |v| Ok(AsymmetricCoulomb { positive: v[0][0], negative: v[1][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.positive], vec![self.negative]]
    }
}

impl FrictionLaw for AsymmetricCoulomb {
    #[inline]
    fn level(&self, at: &Rubbing) -> f64 {
        match at.side {
            Side::Forwards => self.positive,
            Side::Backwards => self.negative,
        }
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn linearised(&self, at: &Sine) -> Linear {
        harmonic::of_friction(self, at)
    }
}
