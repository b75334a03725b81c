//! Where an effect sits.

use serde::{Deserialize, Serialize};

/// Name of the body that does not move.
pub const GROUND: &str = "ground";

/// Where an effect sits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Site {
    /// Between two bodies, or a body and `ground`.
    Between([String; 2]),
    /// At an input or an output.
    Signal(String),
}

impl Site {
    /// Whether one end is ground.
    pub(crate) fn is_at_ground(&self) -> bool {
        self.has_end(GROUND)
    }

    /// Whether one end has this name.
    pub(crate) fn has_end(&self, name: &str) -> bool {
        matches!(self, Site::Between(ends) if ends.iter().any(|end| end == name))
    }

    /// Whether both are the same place, whichever end is named first.
    pub(crate) fn is_same_place(&self, other: &Site) -> bool {
        match (self, other) {
            (Site::Between([a, b]), Site::Between([c, d])) => (a == c && b == d) || (a == d && b == c),
            (Site::Signal(a), Site::Signal(b)) => a == b,
            _ => false,
        }
    }
}
