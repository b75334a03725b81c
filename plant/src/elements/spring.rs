//! Linear spring.

use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, LinearLaw};

/// `f = stiffness (x - rest)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Spring {
    /// N/m.
    pub stiffness: f64,
    /// m.
    pub rest: f64,
}

impl Spring {
    pub(super) const KIND: KindOf<Spring> = KindOf {
        name: "spring",
        equation: "f = k (x - rest)",
        source: "Hooke",
        energy: "stores, creates none",
        parameters: &[
            Parameter::number("stiffness", "N/m", Range::Any, "k; negative for an over-centre mechanism"),
            Parameter::number("rest", "m", Range::Any, "displacement without force").or(0.0),
        ],
        build: |v| Ok(Spring { stiffness: v[0][0], rest: v[1][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.stiffness], vec![self.rest]]
    }
}

impl LinearLaw for Spring {
    fn coefficients(&self) -> Linear {
        Linear { stiffness: self.stiffness, force: -self.stiffness * self.rest, ..Linear::default() }
    }
}
