//! Quadratic drag.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, PathLaw, Slopes};
use super::sine::Sine;

/// `f = coefficient v |v|`.
#[derive(Debug, Clone, PartialEq)]
pub struct QuadraticDrag {
    /// N s²/m².
    pub coefficient: f64,
}

impl QuadraticDrag {
    pub(super) const KIND: KindOf<QuadraticDrag> = KindOf {
        name: "quadratic_drag",
        equation: "f = q v |v|",
        source: "Rayleigh; turbulent flow through an orifice",
        energy: "dissipates, creates none",
        parameters: &[Parameter::number("coefficient", "N s²/m²", Range::NonNegative, "q")],
        build: |v| Ok(QuadraticDrag { coefficient: v[0][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.coefficient]]
    }
}

impl PathLaw for QuadraticDrag {
    fn slopes(&self) -> Slopes {
        // At 1 m/s, a quick hand.
        Slopes { stiffness: 0.0, damping: 2.0 * self.coefficient, bounded: false }
    }

    #[inline]
    fn force(&self, _memory: &[f64], _x: f64, v: f64) -> f64 {
        self.coefficient * v * v.abs()
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
    fn drag_is_odd_and_quadratic() {
        let drag = QuadraticDrag { coefficient: 3.0 };
        assert_eq!(drag.force(&[], 0.0, 2.0), 12.0);
        assert_eq!(drag.force(&[], 0.0, -2.0), -12.0);
    }
}
