//! Forces that displacement alone sets, and inertia between two bodies.

use super::{ForceLaw, Path};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// `f = k (x - rest)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spring {
    /// N/m, k.
    pub stiffness: f64,
    /// m, displacement without force.
    #[serde(default)]
    pub rest: f64,
}

impl ForceLaw for Spring {
    fn path_force(&self, path: &Path, _: &mut [f64]) -> f64 {
        self.stiffness * (path.to - self.rest)
    }

    fn stiffness(&self) -> f64 {
        self.stiffness
    }
}

/// `f = m dv/dt`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inerter {
    /// kg.
    pub inertance: f64,
}

impl ForceLaw for Inerter {
    fn inertance(&self) -> f64 {
        self.inertance
    }
}

/// A constant force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bias {
    /// N.
    pub force: f64,
}

impl ForceLaw for Bias {
    fn path_force(&self, _: &Path, _: &mut [f64]) -> f64 {
        self.force
    }
}

/// `f = k x + k3 x^3`: stiffening for k3 > 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CubicSpring {
    /// N/m, k.
    pub stiffness: f64,
    /// N/m3, k3.
    pub cubic: f64,
}

impl ForceLaw for CubicSpring {
    fn path_force(&self, path: &Path, _: &mut [f64]) -> f64 {
        let x = path.to;
        (self.stiffness + self.cubic * x * x) * x
    }

    /// The slope where the cubic part carries as much as the linear one. Farther out the substep is not chosen for it.
    fn stiffness(&self) -> f64 {
        4.0 * self.stiffness
    }
}

/// `f = a sin(2 pi x/period + phase)`: a ripple fixed to the position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cogging {
    /// N, a.
    pub amplitude: f64,
    /// m.
    pub period: f64,
    /// rad.
    pub phase: f64,
}

impl ForceLaw for Cogging {
    fn path_force(&self, path: &Path, _: &mut [f64]) -> f64 {
        self.amplitude * (2.0 * PI * path.to / self.period + self.phase).sin()
    }

    fn stiffness(&self) -> f64 {
        2.0 * PI * (self.amplitude / self.period).abs()
    }
}
