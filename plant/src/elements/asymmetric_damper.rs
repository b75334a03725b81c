//! Damper that depends on the direction.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, PathLaw, Slopes};
use super::sine::Sine;

/// `f = positive v` for `v > 0`, `negative v` for `v < 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct AsymmetricDamper {
    /// N s/m, for `v > 0`.
    pub positive: f64,
    /// N s/m, for `v < 0`.
    pub negative: f64,
}

impl AsymmetricDamper {
    pub(super) const KIND: KindOf<AsymmetricDamper> = KindOf {
        name: "asymmetric_damper",
        equation: "f = b+ v for v > 0, b- v for v < 0",
        source: "shock absorbers",
        energy: "dissipates, creates none",
        parameters: &[
            Parameter::number("positive", "N s/m", Range::NonNegative, "b+"),
            Parameter::number("negative", "N s/m", Range::NonNegative, "b-"),
        ],
        build: |v| Ok(AsymmetricDamper { positive: v[0][0], negative: v[1][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.positive], vec![self.negative]]
    }
}

impl PathLaw for AsymmetricDamper {
    fn slopes(&self) -> Slopes {
        Slopes { stiffness: 0.0, damping: self.positive.max(self.negative), bounded: true }
    }

    #[inline]
    fn force(&self, _memory: &[f64], _x: f64, v: f64) -> f64 {
        v * if v > 0.0 { self.positive } else { self.negative }
    }

    fn stored(&self, _memory: &[f64], _x: f64) -> f64 {
        0.0
    }

    fn linearised(&self, at: &Sine) -> Linear {
        harmonic::of_path(self, at)
    }

    fn creates_energy(&self, _amplitude: f64, _unit: &str) -> Option<String> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_direction_has_its_own_slope() {
        let damper = AsymmetricDamper { positive: 2.0, negative: 5.0 };
        assert_eq!(damper.force(&[], 0.0, 0.5), 1.0);
        assert_eq!(damper.force(&[], 0.0, -0.5), -2.5);
    }
}
