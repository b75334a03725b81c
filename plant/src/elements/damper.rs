//! Linear damper.

use super::{Kind, Law, Parameter, Range};

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
        parameters: &[Parameter { key: "damping", unit: "N s/m", range: Range::Any, default: None, list: false, doc: "b" }],
        build: |v| Ok(Law::Damper(Damper { damping: v[0][0] })),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.damping]]
    }
}
