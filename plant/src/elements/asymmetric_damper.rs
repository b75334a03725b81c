//! Damper that depends on the direction.

use super::{Kind, Law, Mechanics, Parameter, Range, Slopes};

/// `f = positive v` for `v > 0`, `negative v` for `v < 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct AsymmetricDamper {
    /// N s/m, for `v > 0`.
    pub positive: f64,
    /// N s/m, for `v < 0`.
    pub negative: f64,
}

impl AsymmetricDamper {
    pub(super) const KIND: Kind = Kind {
        name: "asymmetric_damper",
        equation: "f = b+ v for v > 0, b- v for v < 0",
        source: "shock absorbers",
        energy: "takes, creates none",
        parameters: &[
            Parameter::number("positive", "N s/m", Range::NonNegative, "b+"),
            Parameter::number("negative", "N s/m", Range::NonNegative, "b-"),
        ],
        build: |v| Ok(Law::AsymmetricDamper(AsymmetricDamper { positive: v[0][0], negative: v[1][0] })),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.positive], vec![self.negative]]
    }
}

impl Mechanics for AsymmetricDamper {
    fn slopes(&self) -> Slopes {
        Slopes { stiffness: 0.0, damping: self.positive.max(self.negative), bounded: true }
    }

    #[inline]
    fn force(&self, _memory: &[f64], _x: f64, v: f64) -> f64 {
        v * if v > 0.0 { self.positive } else { self.negative }
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
