//! Dahl friction.

use super::decay::decay;
use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, PathLaw, Slopes};
use super::sine::Sine;

/// `dz/dt = v (1 - stiffness z / coulomb sign v)`, `f = stiffness z`. Memory: the bristle deflection z, m.
#[derive(Debug, Clone, PartialEq)]
pub struct Dahl {
    /// N/m, σ.
    pub stiffness: f64,
    /// N.
    pub coulomb: f64,
}

impl Dahl {
    pub(super) const KIND: KindOf<Dahl> = KindOf {
        name: "dahl",
        equation: "dz/dt = v (1 - σ z/c sign v), f = σ z",
        source: "Dahl 1968",
        energy: "dissipates, creates none; its memory is local, so nested loops do not close",
        parameters: &[Parameter::number("stiffness", "N/m", Range::Positive, "σ"), Parameter::number("coulomb", "N", Range::Positive, "c")],
        build: |v| Ok(Dahl { stiffness: v[0][0], coulomb: v[1][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.stiffness], vec![self.coulomb]]
    }
}

impl PathLaw for Dahl {
    fn memory_len(&self) -> usize {
        1
    }

    fn slopes(&self) -> Slopes {
        // On reversal at z = -c/σ the slope is twice σ.
        Slopes { stiffness: 2.0 * self.stiffness, damping: 0.0, bounded: true }
    }

    /// Exact along the path: z relaxes towards ±c/σ over the distance c/σ.
    #[inline]
    fn advance(&self, memory: &mut [f64], from: f64, to: f64, _dt: f64) {
        let [bristle_deflection] = memory else { return };
        let path = to - from;
        if path != 0.0 {
            let settled = (self.coulomb / self.stiffness).copysign(path);
            *bristle_deflection = settled + (*bristle_deflection - settled) * decay(self.stiffness * path.abs() / self.coulomb);
        }
    }

    #[inline]
    fn force(&self, memory: &[f64], _x: f64, _v: f64) -> f64 {
        self.stiffness * memory.first().copied().unwrap_or(0.0)
    }

    fn stored(&self, memory: &[f64], _x: f64) -> f64 {
        let bristle_deflection = memory.first().copied().unwrap_or(0.0);
        0.5 * self.stiffness * bristle_deflection * bristle_deflection
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
    fn virgin_curve_is_an_exponential_whatever_the_steps() {
        let dahl = Dahl { stiffness: 1e4, coulomb: 0.4 };
        for steps in [1, 7, 1000] {
            let mut memory = [0.0];
            let length = 3e-5;
            for i in 0..steps {
                let at = |j: i32| length * f64::from(j) / f64::from(steps);
                dahl.advance(&mut memory, at(i), at(i + 1), 1e-3);
            }
            let exact = 0.4 * (1.0 - (-1e4 * length / 0.4f64).exp());
            assert!((dahl.force(&memory, 0.0, 0.0) - exact).abs() < 1e-13);
        }
    }
}
