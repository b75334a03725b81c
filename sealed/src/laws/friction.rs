//! Dry friction whose level hangs on direction and speed alone.

use super::ForceLaw;
use serde::{Deserialize, Serialize};

/// `f = c sign(v)`; at rest whatever holds, up to c.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coulomb {
    /// N, c.
    pub force: f64,
}

impl ForceLaw for Coulomb {
    fn dry(&self, _: f64, _: f64, _: &[f64]) -> [f64; 2] {
        [self.force, self.force]
    }

    fn is_dry(&self) -> bool {
        true
    }
}

/// `f = c+` forwards, `-c-` backwards.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AsymmetricCoulomb {
    /// N, c+.
    pub positive: f64,
    /// N, c-.
    pub negative: f64,
}

impl ForceLaw for AsymmetricCoulomb {
    fn dry(&self, _: f64, _: f64, _: &[f64]) -> [f64; 2] {
        [self.positive, self.negative]
    }

    fn is_dry(&self) -> bool {
        true
    }
}

/// `f = (c + (s - c) exp(-(v/vs)^2)) sign(v)` with s at rest above c.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stribeck {
    /// N, c.
    pub coulomb: f64,
    /// N, s.
    #[serde(rename = "static")]
    pub at_rest: f64,
    /// m/s, vs.
    pub velocity: f64,
}

impl ForceLaw for Stribeck {
    fn dry(&self, v: f64, _: f64, _: &[f64]) -> [f64; 2] {
        let level = between_rest_and_speed(self.at_rest, self.coulomb, v / self.velocity);
        [level, level]
    }

    fn is_dry(&self) -> bool {
        true
    }
}

/// `f = (c - (c - r) exp(-(v/vs)^2)) sign(v)` with r at rest below c.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionDeficit {
    /// N, c.
    pub coulomb: f64,
    /// N, r.
    pub rest: f64,
    /// m/s, vs.
    pub velocity: f64,
}

impl ForceLaw for FrictionDeficit {
    fn dry(&self, v: f64, _: f64, _: &[f64]) -> [f64; 2] {
        let level = between_rest_and_speed(self.rest, self.coulomb, v / self.velocity);
        [level, level]
    }

    fn is_dry(&self) -> bool {
        true
    }
}

/// Level that goes from `at_rest` to `kinetic` as a Gaussian of the speed over its scale (Stribeck's curve in the form of Tustin and Armstrong).
pub(super) fn between_rest_and_speed(at_rest: f64, kinetic: f64, ratio: f64) -> f64 {
    kinetic + (at_rest - kinetic) * (-ratio * ratio).exp()
}
