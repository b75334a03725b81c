//! Smooth forces that speed sets.

use super::ForceLaw;
use serde::{Deserialize, Serialize};

/// `f = b v`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Damper {
    /// N s/m, b.
    pub damping: f64,
}

impl ForceLaw for Damper {
    fn damping(&self, _: f64, _: f64, _: &[f64]) -> f64 {
        self.damping
    }
}

/// `f = b+ v` forwards, `b- v` backwards.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AsymmetricDamper {
    /// N s/m, b+.
    pub positive: f64,
    /// N s/m, b-.
    pub negative: f64,
}

impl ForceLaw for AsymmetricDamper {
    fn damping(&self, _: f64, v: f64, _: &[f64]) -> f64 {
        if v >= 0.0 { self.positive } else { self.negative }
    }
}

/// `f = q v abs(v)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QuadraticDrag {
    /// N s2/m2, q.
    pub coefficient: f64,
}

impl ForceLaw for QuadraticDrag {
    fn damping(&self, _: f64, v: f64, _: &[f64]) -> f64 {
        self.coefficient * v.abs()
    }
}
