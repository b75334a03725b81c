//! LuGre friction.

use super::decay::decay;
use super::gaussian::between_rest_and_speed;
use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{Bristles, Linear, PathLaw, Slopes};
use super::sine::Sine;

/// `dz/dt = v - σ0 |v| z / g(v)`, `g(v) = coulomb + (static - coulomb) exp(-(v/velocity)²)`,
/// `f = σ0 z + σ1 dz/dt`. Memory: the bristle deflection z, m.
///
/// Without the viscous term, which is a `damper` beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Lugre {
    /// N/m, σ0.
    pub stiffness: f64,
    /// N s/m, σ1.
    pub damping: f64,
    /// N, at speed.
    pub coulomb: f64,
    /// N, at rest; `static` in model files.
    pub at_rest: f64,
    /// m/s.
    pub velocity: f64,
}

impl Lugre {
    pub(super) const KIND: KindOf<Lugre> = KindOf {
        name: "lugre",
        equation: "dz/dt = v - σ0 |v| z/g(v), f = σ0 z + σ1 dz/dt, g = c + (s - c) exp(-(v/vs)²)",
        source: "Canudas de Wit, Olsson, Astrom & Lischinsky 1995, without the viscous term",
        energy: "may create some on quick reversals unless a damper of at least σ1 (s - c)/c acts in parallel (Barabanov & Ortega 2000)",
        parameters: &[
            Parameter::number("stiffness", "N/m", Range::Positive, "σ0"),
            Parameter::number("damping", "N s/m", Range::NonNegative, "σ1"),
            Parameter::number("coulomb", "N", Range::Positive, "c"),
            Parameter::number("static", "N", Range::Positive, "s, at least c"),
            Parameter::number("velocity", "m/s", Range::Positive, "vs"),
        ],
        build: |v| {
            let (coulomb, at_rest) = (v[2][0], v[3][0]);
            if at_rest < coulomb {
                return Err(format!("static ({at_rest}) must be at least coulomb ({coulomb})"));
            }
            Ok(Lugre { stiffness: v[0][0], damping: v[1][0], coulomb, at_rest, velocity: v[4][0] })
        },
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.stiffness], vec![self.damping], vec![self.coulomb], vec![self.at_rest], vec![self.velocity]]
    }

    /// Steady friction level g at speed `v`, N.
    #[inline]
    pub fn level(&self, v: f64) -> f64 {
        between_rest_and_speed(self.at_rest, self.coulomb, v / self.velocity)
    }
}

impl PathLaw for Lugre {
    fn memory_len(&self) -> usize {
        1
    }

    fn slopes(&self) -> Slopes {
        Slopes { stiffness: 2.0 * self.stiffness, damping: 2.0 * self.damping, bounded: true }
    }

    /// Exact at constant speed: z relaxes towards ±g(v)/σ0 over the distance g(v)/σ0.
    #[inline]
    fn advance(&self, memory: &mut [f64], from: f64, to: f64, dt: f64) {
        let [bristle_deflection] = memory else { return };
        let path = to - from;
        if path != 0.0 && dt > 0.0 {
            let level = self.level(path / dt);
            let settled = (level / self.stiffness).copysign(path);
            *bristle_deflection = settled + (*bristle_deflection - settled) * decay(self.stiffness * path.abs() / level);
        }
    }

    fn is_costly(&self) -> bool {
        true
    }

    #[inline]
    fn force(&self, memory: &[f64], _x: f64, v: f64) -> f64 {
        let bristle_force = self.stiffness * memory.first().copied().unwrap_or(0.0);
        bristle_force + self.damping * (v - v.abs() * bristle_force / self.level(v))
    }

    fn bristles(&self, memory: &[f64], v: f64) -> Option<Bristles> {
        let force = self.stiffness * memory.first().copied().unwrap_or(0.0);
        Some(Bristles { force, stiffness: self.stiffness, damping: self.damping, leak: v.abs() / self.level(v) })
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
    fn steady_force_is_the_stribeck_curve() {
        let lugre = Lugre { stiffness: 1e5, damping: 50.0, coulomb: 0.4, at_rest: 0.6, velocity: 0.01 };
        let mut memory = [0.0];
        for i in 0..1000 {
            lugre.advance(&mut memory, -1e-6 * f64::from(i), -1e-6 * f64::from(i + 1), 1e-4);
        }
        assert!((lugre.force(&memory, 0.0, -0.01) + 0.4 + 0.2 * (-1.0f64).exp()).abs() < 1e-12);
    }
}
