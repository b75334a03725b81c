//! Constant force.

use super::{Kind, Law, Linear, Mechanics, Parameter, Range, Role};

/// `f = force`.
#[derive(Debug, Clone, PartialEq)]
pub struct Bias {
    /// N; positive pushes the first body backwards.
    pub force: f64,
}

impl Bias {
    pub(super) const KIND: Kind = Kind {
        name: "bias",
        equation: "f = constant",
        source: "weight, preload",
        energy: "stores without bound (as weight does), creates none over a closed path",
        parameters: &[Parameter::number("force", "N", Range::Any, "positive pushes the first body backwards")],
        build: |v| Ok(Law::Bias(Bias { force: v[0][0] })),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.force]]
    }
}

impl Mechanics for Bias {
    fn role(&self) -> Role {
        Role::Linear(Linear { force: self.force, ..Linear::default() })
    }
}
