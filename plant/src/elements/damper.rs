//! Linear damper.

use super::{Kind, Law, Linear, Mechanics, Parameter, Range, Role};

/// `f = damping v`.
#[derive(Debug, Clone, PartialEq)]
pub struct Damper {
    /// N s/m.
    pub damping: f64,
}

impl Damper {
    pub(super) const KIND: Kind = Kind {
        name: "damper",
        equation: "f = b v",
        source: "Newton",
        energy: "takes, creates none while b >= 0",
        parameters: &[Parameter::number("damping", "N s/m", Range::Any, "b")],
        build: |v| Ok(Law::Damper(Damper { damping: v[0][0] })),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.damping]]
    }
}

impl Mechanics for Damper {
    fn role(&self) -> Role {
        Role::Linear(Linear { damping: self.damping, ..Linear::default() })
    }
}
