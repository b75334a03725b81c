//! Linear damper.

use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, LinearLaw};

/// `f = damping v`.
#[derive(Debug, Clone, PartialEq)]
pub struct Damper {
    /// N s/m.
    pub damping: f64,
}

impl Damper {
    pub(super) const KIND: KindOf<Damper> = KindOf {
        name: "damper",
        equation: "f = b v",
        source: "Newton",
        energy: "dissipates, creates none while b >= 0",
        parameters: &[Parameter::number("damping", "N s/m", Range::Any, "b")],
        build: |v| Ok(Damper { damping: v[0][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.damping]]
    }
}

impl LinearLaw for Damper {
    fn coefficients(&self) -> Linear {
        Linear { damping: self.damping, ..Linear::default() }
    }
}
