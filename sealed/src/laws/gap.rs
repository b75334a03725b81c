//! Shafts with a gap: sharp, as model files have it, and rounded.

use super::{ForceLaw, Path};
use serde::{Deserialize, Serialize};

/// Shaft with inner damping behind a gap (Nordin, Galic' and Gutman 1997): the place `y` of the shaft's end within the gap moves by
/// `dy/dt = dx/dt + (k/c)(x - y)` and stops at `±gap/2`; `f = k (x - y) + c (dx/dt - dy/dt)`. Between the stops that force is zero.
///
/// Where x moves by d in a time h, the twist x - y decays by `exp(-k h/c)`, which is how y is carried on: exact away from the stops.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backlash {
    /// m, whole width.
    pub gap: f64,
    /// N/m, k.
    pub stiffness: f64,
    /// N s/m, c.
    pub damping: f64,
}

impl ForceLaw for Backlash {
    fn memory(&self) -> usize {
        1
    }

    fn path_force(&self, path: &Path, memory: &mut [f64]) -> f64 {
        let twist = (path.from - memory[0]) * (-self.stiffness * path.duration / self.damping).exp();
        let free = path.to - twist;
        let half = 0.5 * self.gap;
        memory[0] = free.clamp(-half, half);
        if free.abs() < half { 0.0 } else { self.stiffness * (path.to - memory[0]) }
    }

    fn damping(&self, _: f64, _: f64, memory: &[f64]) -> f64 {
        if memory[0].abs() < 0.5 * self.gap { 0.0 } else { self.damping }
    }

    fn stiffness(&self) -> f64 {
        self.stiffness
    }
}

/// Shaft behind a gap whose edges are worn round: `f = k s(x) + c s'(x) v` with
/// `s(x) = w (ln(1 + e^((x - g/2)/w)) - ln(1 + e^((-x - g/2)/w)))`.
///
/// s goes from 0 inside the gap g to `x ∓ g/2` outside, over a few widths w of rounding. It has no memory, and unlike a gap with
/// sharp edges its stiffness is never quite zero: `s'(0) = 2/(1 + e^(g/(2w)))`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoundedGap {
    /// m, g, whole width.
    pub gap: f64,
    /// m, w.
    pub rounding: f64,
    /// N/m, k, far outside.
    pub stiffness: f64,
    /// N s/m, c, far outside.
    pub damping: f64,
}

impl RoundedGap {
    /// m, the shaft's twist s at displacement `x` (m).
    pub fn twist(&self, x: f64) -> f64 {
        let (w, half) = (self.rounding, 0.5 * self.gap);
        w * (softplus((x - half) / w) - softplus((-x - half) / w))
    }

    /// The share s' of the contact that carries at displacement `x` (m), 0 to 1.
    pub fn contact(&self, x: f64) -> f64 {
        let (w, half) = (self.rounding, 0.5 * self.gap);
        logistic((x - half) / w) + logistic((-x - half) / w)
    }
}

impl ForceLaw for RoundedGap {
    fn path_force(&self, path: &Path, _: &mut [f64]) -> f64 {
        self.stiffness * self.twist(path.to)
    }

    fn damping(&self, x: f64, _: f64, _: &[f64]) -> f64 {
        self.damping * self.contact(x)
    }

    fn stiffness(&self) -> f64 {
        self.stiffness
    }
}

/// `ln(1 + e^u)` without overflow.
fn softplus(u: f64) -> f64 {
    u.max(0.0) + (-u.abs()).exp().ln_1p()
}

/// `1/(1 + e^(-u))`.
fn logistic(u: f64) -> f64 {
    1.0 / (1.0 + (-u).exp())
}
