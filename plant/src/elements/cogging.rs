//! Cogging: a force that repeats with position.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, PathLaw, Slopes};
use super::sine::Sine;
use std::f64::consts::TAU;

/// `f = amplitude sin(2π x/period + phase)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Cogging {
    /// N.
    pub amplitude: f64,
    /// m.
    pub period: f64,
    /// rad.
    pub phase: f64,
}

impl Cogging {
    pub(super) const KIND: KindOf<Cogging> = KindOf {
        name: "cogging",
        equation: "f = a sin(2π x/period + phase)",
        source: "slots and magnets of a motor, teeth of a gear",
        energy: "stores, creates none",
        parameters: &[
            Parameter::number("amplitude", "N", Range::Any, "a"),
            Parameter::number("period", "m", Range::Positive, "distance after which it repeats"),
            Parameter::number("phase", "rad", Range::Any, "at x = 0").or(0.0),
        ],
        build: |v| Ok(Cogging { amplitude: v[0][0], period: v[1][0], phase: v[2][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.amplitude], vec![self.period], vec![self.phase]]
    }
}

impl PathLaw for Cogging {
    fn slopes(&self) -> Slopes {
        Slopes { stiffness: TAU * self.amplitude.abs() / self.period, damping: 0.0, bounded: true }
    }

    #[inline]
    fn force(&self, _memory: &[f64], x: f64, _v: f64) -> f64 {
        self.amplitude * (TAU * x / self.period + self.phase).sin()
    }

    fn stored(&self, _memory: &[f64], x: f64) -> f64 {
        self.amplitude * self.period / TAU * (self.phase.cos() - (TAU * x / self.period + self.phase).cos())
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
    fn repeats_and_stores_nothing_over_a_period() {
        let cogging = Cogging { amplitude: 0.2, period: 0.01, phase: 0.7 };
        assert!((cogging.force(&[], 0.003, 0.0) - cogging.force(&[], 0.013, 0.0)).abs() < 1e-14);
        assert!(cogging.stored(&[], 0.01).abs() < 1e-16);
    }
}
