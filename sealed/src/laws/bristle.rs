//! One bristle for all of a surface: Dahl's and the LuGre law.

use super::friction::between_rest_and_speed;
use super::{ForceLaw, Path};
use serde::{Deserialize, Serialize};

/// `dz/dt = v (1 - s z/c sign v)`, `f = s z` (Dahl 1968). Memory: z, m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dahl {
    /// N/m, s.
    pub stiffness: f64,
    /// N, c.
    pub coulomb: f64,
}

impl ForceLaw for Dahl {
    fn memory(&self) -> usize {
        1
    }

    fn path_force(&self, path: &Path, memory: &mut [f64]) -> f64 {
        memory[0] = bent(memory[0], path.to - path.from, self.coulomb / self.stiffness);
        self.stiffness * memory[0]
    }

    /// Just after a reversal from sliding.
    fn stiffness(&self) -> f64 {
        2.0 * self.stiffness
    }
}

/// `dz/dt = v - s abs(v) z/g(v)`, `f = s z + d dz/dt`, `g = c + (h - c) exp(-(v/vs)^2)` (Canudas de Wit and others 1995), without
/// the viscous term. Memory: z, m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lugre {
    /// N/m, s.
    pub stiffness: f64,
    /// N s/m, d.
    pub damping: f64,
    /// N, c.
    pub coulomb: f64,
    /// N, h, at least c.
    #[serde(rename = "static")]
    pub at_rest: f64,
    /// m/s, vs.
    pub velocity: f64,
}

impl Lugre {
    fn level(&self, v: f64) -> f64 {
        between_rest_and_speed(self.at_rest, self.coulomb, v / self.velocity)
    }
}

impl ForceLaw for Lugre {
    fn memory(&self) -> usize {
        1
    }

    fn path_force(&self, path: &Path, memory: &mut [f64]) -> f64 {
        memory[0] = bent(memory[0], path.to - path.from, self.level(path.speed) / self.stiffness);
        self.stiffness * memory[0]
    }

    /// `dz/dt` over v, times d.
    fn damping(&self, _: f64, v: f64, memory: &[f64]) -> f64 {
        let sign = if v == 0.0 { 0.0 } else { v.signum() };
        self.damping * (1.0 - sign * self.stiffness * memory[0] / self.level(v))
    }

    fn stiffness(&self) -> f64 {
        2.0 * self.stiffness
    }
}

/// The bristle after a way of `moved` (m), when it nears `±most` (m) as one over e on each way of `most`: exact while `most` stays.
fn bent(deflection: f64, moved: f64, most: f64) -> f64 {
    if moved == 0.0 {
        return deflection;
    }
    let end = most.copysign(moved);
    end + (deflection - end) * (-moved.abs() / most).exp()
}
