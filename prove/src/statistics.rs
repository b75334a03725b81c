//! Numbers over several cases.

use serde::Serialize;

/// A share as counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Share {
    /// How many are.
    pub are: usize,
    /// Of how many.
    pub of: usize,
}

impl std::fmt::Display for Share {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {}", self.are, self.of)
    }
}
