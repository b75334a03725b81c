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

/// The middle one; of an even number the mean of the middle two.
pub fn median(mut of: Vec<f64>) -> Option<f64> {
    of.sort_by(f64::total_cmp);
    let n = of.len();
    (n > 0).then(|| 0.5 * (of[(n - 1) / 2] + of[n / 2]))
}
