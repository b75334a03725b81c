//! Hardening or softening spring.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, PathLaw, Slopes};
use super::sine::Sine;

/// `f = stiffness x + cubic x³`.
#[derive(Debug, Clone, PartialEq)]
pub struct CubicSpring {
    /// k, N/m.
    pub stiffness: f64,
    /// k3, N/m³.
    pub cubic: f64,
}

impl CubicSpring {
    pub(super) const KIND: KindOf<CubicSpring> = KindOf {
        name: "cubic_spring",
        equation: "f = k x + k3 x³",
        source: "Duffing 1918",
        energy: "stores, creates none; without bound when k3 < 0, past x² = -k/k3",
        parameters: &[
            Parameter::number("stiffness", "N/m", Range::Any, "k").or(0.0),
            Parameter::number("cubic", "N/m³", Range::Any, "k3; negative softens"),
        ],
        build: |v| Ok(CubicSpring { stiffness: v[0][0], cubic: v[1][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.stiffness], vec![self.cubic]]
    }
}

impl PathLaw for CubicSpring {
    fn slopes(&self) -> Slopes {
        // Where the cubic part has brought the slope to three times the initial one; without a linear part, at 10 mm.
        let stiffness = if self.stiffness > 0.0 { 3.0 * self.stiffness } else { 3.0 * self.cubic.abs() * 1e-4 };
        Slopes { stiffness, damping: 0.0, bounded: false }
    }

    #[inline]
    fn force(&self, _memory: &[f64], x: f64, _v: f64) -> f64 {
        x * (self.stiffness + self.cubic * x * x)
    }

    fn stored(&self, _memory: &[f64], x: f64) -> f64 {
        let square = x * x;
        square * (0.5 * self.stiffness + 0.25 * self.cubic * square)
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
    fn force_is_the_slope_of_the_stored_energy() {
        let spring = CubicSpring { stiffness: 300.0, cubic: 2e6 };
        let x = 0.013;
        let slope = (spring.stored(&[], x + 1e-6) - spring.stored(&[], x - 1e-6)) / 2e-6;
        assert!((slope / spring.force(&[], x, 0.0) - 1.0).abs() < 1e-7);
    }
}
