//! Contact after Hunt and Crossley.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, PathLaw, Slopes};
use super::sine::Sine;

/// `f = max(0, stiffness qⁿ + damping qⁿ v)` where `q = x - gap > 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct HuntCrossley {
    /// k, N/mⁿ.
    pub stiffness: f64,
    /// λ, N s/m^(n+1).
    pub damping: f64,
    /// n.
    pub exponent: f64,
    /// m.
    pub gap: f64,
}

/// Depth at which the slopes are estimated: a fingertip or a foam is pressed this far, m.
const ORDINARY_DEPTH_M: f64 = 1e-3;

impl HuntCrossley {
    pub(super) const KIND: KindOf<HuntCrossley> = KindOf {
        name: "hunt_crossley",
        equation: "f = max(0, k qⁿ + λ qⁿ v) where q = x - gap > 0",
        source: "Hunt & Crossley 1975",
        energy: "dissipates, creates none",
        parameters: &[
            Parameter::number("stiffness", "N/m^n", Range::NonNegative, "k"),
            Parameter::number("damping", "N s/m^(n+1)", Range::NonNegative, "λ").or(0.0),
            Parameter::number("exponent", "-", Range::Between(1.0, 10.0), "n").or(1.5),
            Parameter::number("gap", "m", Range::Any, "displacement at which it touches").or(0.0),
        ],
        build: |v| Ok(HuntCrossley { stiffness: v[0][0], damping: v[1][0], exponent: v[2][0], gap: v[3][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.stiffness], vec![self.damping], vec![self.exponent], vec![self.gap]]
    }

    #[inline]
    fn power(&self, depth: f64) -> f64 {
        if self.exponent == 1.5 { depth * depth.sqrt() } else { depth.powf(self.exponent) }
    }
}

impl PathLaw for HuntCrossley {
    fn slopes(&self) -> Slopes {
        let power = self.power(ORDINARY_DEPTH_M);
        Slopes { stiffness: self.stiffness * self.exponent * power / ORDINARY_DEPTH_M, damping: self.damping * power, bounded: false }
    }

    #[inline]
    fn force(&self, _memory: &[f64], x: f64, v: f64) -> f64 {
        let depth = x - self.gap;
        if depth > 0.0 { (self.power(depth) * (self.stiffness + self.damping * v)).max(0.0) } else { 0.0 }
    }

    #[inline]
    fn mean_force(&self, memory: &[f64], from: f64, to: f64, v: f64) -> f64 {
        let (start, end) = (from - self.gap, to - self.gap);
        let deepest = start.max(end);
        if deepest <= 0.0 {
            0.0
        } else if start > 0.0 && end > 0.0 {
            self.force(memory, 0.5 * (from + to), v)
        } else {
            // The mean of qⁿ between 0 and the deepest, for the share of the path in touch.
            let share = deepest / (start - end).abs();
            (share * self.power(deepest) / (self.exponent + 1.0) * (self.stiffness + self.damping * v)).max(0.0)
        }
    }

    fn stored(&self, _memory: &[f64], x: f64) -> f64 {
        let depth = (x - self.gap).max(0.0);
        self.stiffness * self.power(depth) * depth / (self.exponent + 1.0)
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
    fn pushes_only_and_follows_the_power_law() {
        let wall = HuntCrossley { stiffness: 1e4, damping: 2e4, exponent: 1.5, gap: 0.0 };
        assert_eq!(wall.force(&[], -0.01, 1.0), 0.0);
        assert_eq!(wall.force(&[], 0.01, -1.0), 0.0);
        assert!((wall.force(&[], 0.01, 0.0) - 1e4 * 0.01f64.powf(1.5)).abs() < 1e-12);
    }
}
