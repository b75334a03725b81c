//! Linear spring.

use super::{Kind, Law, Parameter, Range};

/// `f = stiffness (x - rest)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Spring {
    /// N/m.
    pub stiffness: f64,
    /// m.
    pub rest: f64,
}

impl Spring {
    pub(super) const KIND: Kind = Kind {
        name: "spring",
        equation: "f = k (x - rest)",
        source: "Hooke",
        energy: "stores, creates none",
        parameters: &[
            Parameter {
                key: "stiffness",
                unit: "N/m",
                range: Range::Any,
                default: None,
                list: false,
                doc: "k; negative for an over-centre mechanism",
            },
            Parameter { key: "rest", unit: "m", range: Range::Any, default: Some(0.0), list: false, doc: "displacement without force" },
        ],
        build: |v| Ok(Law::Spring(Spring { stiffness: v[0][0], rest: v[1][0] })),
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.stiffness], vec![self.rest]]
    }
}
