//! Contact with a wall.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, PathLaw, Slopes};
use super::sine::Sine;

/// `f = max(0, stiffness q + damping v)` where `q = x - gap > 0`: pushes only.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// N/m.
    pub stiffness: f64,
    /// N s/m.
    pub damping: f64,
    /// m.
    pub gap: f64,
}

impl Contact {
    pub(super) const KIND: KindOf<Contact> = KindOf {
        name: "contact",
        equation: "f = max(0, k q + b v) where q = x - gap > 0",
        source: "Kelvin-Voigt, one-sided",
        energy: "dissipates, creates none",
        parameters: &[
            Parameter::number("stiffness", "N/m", Range::NonNegative, "k"),
            Parameter::number("damping", "N s/m", Range::NonNegative, "b").or(0.0),
            Parameter::number("gap", "m", Range::Any, "displacement at which it touches").or(0.0),
        ],
        build: |v| Ok(Contact { stiffness: v[0][0], damping: v[1][0], gap: v[2][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.stiffness], vec![self.damping], vec![self.gap]]
    }
}

impl PathLaw for Contact {
    fn slopes(&self) -> Slopes {
        Slopes { stiffness: self.stiffness, damping: self.damping, bounded: true }
    }

    #[inline]
    fn force(&self, _memory: &[f64], x: f64, v: f64) -> f64 {
        let depth = x - self.gap;
        if depth > 0.0 { (self.stiffness * depth + self.damping * v).max(0.0) } else { 0.0 }
    }

    /// Exact: the damper's share of the force sets in with a jump where it touches.
    #[inline]
    fn mean_force(&self, _memory: &[f64], from: f64, to: f64, v: f64) -> f64 {
        let (start, end) = (from - self.gap, to - self.gap);
        if start <= 0.0 && end <= 0.0 {
            return 0.0;
        }
        // Share of the path in touch, and the depths between which it lies.
        let share = if start > 0.0 && end > 0.0 { 1.0 } else { start.max(end) / (start - end).abs() };
        let [a, b] = [start.max(0.0), end.max(0.0)].map(|depth| self.stiffness * depth + self.damping * v);
        let (low, high) = (a.min(b), a.max(b));
        if low >= 0.0 {
            share * 0.5 * (low + high)
        } else if high > 0.0 {
            share * 0.5 * high * high / (high - low)
        } else {
            0.0
        }
    }

    fn stored(&self, _memory: &[f64], x: f64) -> f64 {
        let depth = (x - self.gap).max(0.0);
        0.5 * self.stiffness * depth * depth
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
    fn mean_force_is_the_mean_of_the_force() {
        let wall = Contact { stiffness: 100.0, damping: 5.0, gap: 0.01 };
        for (from, to, v) in
            [(0.0, 0.03, 0.2), (0.03, 0.0, -0.2), (0.02, 0.05, -0.4), (0.012, 0.011, 0.0), (0.0, 0.009, 1.0), (0.03, 0.02, -9.0)]
        {
            let sum: f64 = (0..100_000).map(|i| wall.force(&[], from + (to - from) * (f64::from(i) + 0.5) / 1e5, v)).sum();
            assert!((wall.mean_force(&[], from, to, v) - sum / 1e5).abs() < 1e-4, "{from} {to} {v}");
        }
    }

    #[test]
    fn pushes_only() {
        let wall = Contact { stiffness: 100.0, damping: 5.0, gap: 0.01 };
        assert_eq!(wall.force(&[], 0.0, 1.0), 0.0);
        assert_eq!(wall.force(&[], 0.02, -10.0), 0.0);
        assert!((wall.force(&[], 0.02, 1.0) - 6.0).abs() < 1e-12);
    }
}
