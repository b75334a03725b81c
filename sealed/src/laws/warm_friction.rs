//! Dry friction that its own heat lowers.

use super::ForceLaw;
use serde::{Deserialize, Serialize};

/// Coulomb friction that falls as the rubbing parts warm: `c(T) = c0/(1 + T/T_half)`, with the warming T above the surroundings fed by
/// the friction's own power and cooling with a time constant: `dT/dt = c abs(v)/C - T/tau`.
///
/// The form is that of a lubricant whose viscosity falls with temperature, to first order. Memory: T, K.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WarmFriction {
    /// N, c0, cold.
    pub force: f64,
    /// K, T_half: the warming that halves the friction.
    pub half_warming: f64,
    /// J/K, C.
    pub heat_capacity: f64,
    /// s, tau.
    pub cooling_time: f64,
}

impl WarmFriction {
    /// N, friction after rubbing for long at speed `v` (m/s): c that solves `c (1 + c beta) = c0`, `beta = abs(v) tau/(C T_half)`.
    pub fn steady(&self, v: f64) -> f64 {
        let beta = v.abs() * self.cooling_time / (self.heat_capacity * self.half_warming);
        2.0 * self.force / (1.0 + (1.0 + 4.0 * beta * self.force).sqrt())
    }
}

impl ForceLaw for WarmFriction {
    fn memory(&self) -> usize {
        1
    }

    fn dry(&self, _: f64, _: f64, memory: &[f64]) -> [f64; 2] {
        let level = self.force / (1.0 + memory[0] / self.half_warming);
        [level, level]
    }

    fn is_dry(&self) -> bool {
        true
    }

    /// Exact for a power that is constant over the time.
    fn after(&self, friction: f64, v: f64, duration: f64, memory: &mut [f64]) {
        let steady = (friction * v).max(0.0) * self.cooling_time / self.heat_capacity;
        memory[0] = steady + (memory[0] - steady) * (-duration / self.cooling_time).exp();
    }
}
