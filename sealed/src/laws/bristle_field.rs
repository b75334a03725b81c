//! Elasto-plastic bristles: each a spring that lets go at its own force.

use super::friction::between_rest_and_speed;
use super::{ForceLaw, Path};
use serde::{Deserialize, Serialize};

/// Parallel spring-sliders (Iwan 1966): `f = sum k_i z_i`, each z_i follows the displacement and stays within `±f_i/k_i`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpringSliders {
    /// N/m, k_i.
    pub stiffness: Vec<f64>,
    /// N, f_i; as many.
    pub force: Vec<f64>,
}

impl ForceLaw for SpringSliders {
    fn memory(&self) -> usize {
        self.stiffness.len()
    }

    fn path_force(&self, path: &Path, memory: &mut [f64]) -> f64 {
        slide(&self.stiffness, &self.force, 1.0, path, memory)
    }

    fn stiffness(&self) -> f64 {
        self.stiffness.iter().sum()
    }
}

/// A field of bristles whose stiffness and break-away force are spread widely and independently of each other.
///
/// Both are log-logistic over the field, in proportions that [`BristleField::bristles`] fixes, so that a few numbers say it all:
/// the first slope of the virgin curve is `stiffness`, the force of steady sliding is `force`. Break-away forces may be higher
/// near rest: all of them are then multiplied by `1 + (static_ratio - 1) exp(-(v/velocity)^2)`. No LuGre or Dahl law has this
/// virgin curve, nor their loops its non-local memory; a handful of spring-sliders comes near it but never meets it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BristleField {
    /// N/m, of all bristles together.
    pub stiffness: f64,
    /// N, of steady sliding, all bristles together.
    pub force: f64,
    /// Spread of stiffness: the logistic scale of its logarithm.
    pub stiffness_spread: f64,
    /// Spread of break-away force: the logistic scale of its logarithm.
    pub force_spread: f64,
    /// How many bristles there are.
    pub count: usize,
    /// Break-away force at rest over that at speed, at least 1.
    pub static_ratio: f64,
    /// m/s, speed at which the excess at rest has fallen to 1/e.
    pub velocity: f64,
}

impl BristleField {
    /// Stiffness (N/m) and break-away force (N) of every bristle.
    pub fn bristles(&self) -> SpringSliders {
        // Quantiles of the two at places that never line up: evenly spaced, and spaced by the golden ratio.
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let n = self.count.max(1);
        let quantile = |share: f64| (share / (1.0 - share)).ln();
        let even = |i: usize| (i as f64 + 0.5) / n as f64;
        let golden = |i: usize| ((i as f64 + 0.5) * GOLDEN).fract().clamp(1e-3, 1.0 - 1e-3);
        let stiffness: Vec<f64> = (0..n).map(|i| (self.stiffness_spread * quantile(even(i))).exp()).collect();
        let force: Vec<f64> = (0..n).map(|i| (self.force_spread * quantile(golden(i))).exp()).collect();
        let scaled = |shares: Vec<f64>, total: f64| -> Vec<f64> {
            let sum: f64 = shares.iter().sum();
            shares.into_iter().map(|share| share * total / sum).collect()
        };
        SpringSliders { stiffness: scaled(stiffness, self.stiffness), force: scaled(force, self.force) }
    }

    /// The field with its bristles laid out, ready to step.
    pub fn laid_out(&self) -> LaidField {
        LaidField { bristles: self.bristles(), static_ratio: self.static_ratio, velocity: self.velocity }
    }
}

/// A [`BristleField`] with every bristle's numbers at hand.
#[derive(Debug, Clone, PartialEq)]
pub struct LaidField {
    bristles: SpringSliders,
    static_ratio: f64,
    velocity: f64,
}

impl ForceLaw for LaidField {
    fn memory(&self) -> usize {
        self.bristles.memory()
    }

    fn path_force(&self, path: &Path, memory: &mut [f64]) -> f64 {
        let level = between_rest_and_speed(self.static_ratio, 1.0, path.speed / self.velocity);
        slide(&self.bristles.stiffness, &self.bristles.force, level, path, memory)
    }

    fn stiffness(&self) -> f64 {
        self.bristles.stiffness()
    }
}

/// Carries the deflections (m) along the path and adds their forces; break-away forces are multiplied by `level`.
fn slide(stiffness: &[f64], force: &[f64], level: f64, path: &Path, deflection: &mut [f64]) -> f64 {
    let moved = path.to - path.from;
    let mut total = 0.0;
    for ((k, f), z) in stiffness.iter().zip(force).zip(deflection) {
        let most = level * f / k;
        *z = (*z + moved).clamp(-most, most);
        total += k * *z;
    }
    total
}
