//! Constant force.

use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, LinearLaw};

/// `f = force`.
#[derive(Debug, Clone, PartialEq)]
pub struct Bias {
    /// N; positive pushes the first body backwards.
    pub force: f64,
}

impl Bias {
    pub(super) const KIND: KindOf<Bias> = KindOf {
        name: "bias",
        equation: "f = constant",
        source: "weight, preload",
        energy: "stores without bound (as weight does), creates none over a closed path",
        parameters: &[Parameter::number("force", "N", Range::Any, "positive pushes the first body backwards")],
        build: |v| Ok(Bias { force: v[0][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.force]]
    }
}

impl LinearLaw for Bias {
    fn coefficients(&self) -> Linear {
        Linear { force: self.force, ..Linear::default() }
    }
}
