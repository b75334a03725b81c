//! How long a fit goes on.

/// How long a fit goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Gauss-Newton steps at most.
    pub steps: usize,
    /// A fit ends when the predicted decrease of its next step is below this many mean squared residuals.
    pub tolerance: f64,
}
