//! Inerter.

use super::kind::{KindOf, Parameter, Range};
use super::law::{Linear, LinearLaw};

/// `f = inertance dv/dt`.
#[derive(Debug, Clone, PartialEq)]
pub struct Inerter {
    /// kg.
    pub inertance: f64,
}

impl Inerter {
    pub(super) const KIND: KindOf<Inerter> = KindOf {
        name: "inerter",
        equation: "f = b dv/dt",
        source: "Smith 2002; Papageorgiou, Lockwood, Houghton & Smith 2007, eq (1)",
        energy: "stores, creates none",
        parameters: &[Parameter::number("inertance", "kg", Range::NonNegative, "b")],
        build: |v| Ok(Inerter { inertance: v[0][0] }),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.inertance]]
    }
}

impl LinearLaw for Inerter {
    fn coefficients(&self) -> Linear {
        Linear { inertance: self.inertance, ..Linear::default() }
    }
}
