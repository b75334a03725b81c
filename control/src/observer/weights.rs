//! What errors and disturbances weigh.

use super::system::System;
use nalgebra::DMatrix;

/// What errors and disturbances weigh: the diagonals of Q_phi and Q_eps. The paper has 1 for all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Q_phi of every state's error, 1 / unit squared, above 0.
    pub state: f64,
    /// Q_phi of the unknown input's error, 1 / (N or N m) squared, above 0.
    pub force: f64,
    /// Q_w, no unit, above 0.
    pub noise: f64,
    /// Q_f of the unknown input's rate of change, 1 / (N/s or N m/s) squared, above 0.
    pub rate: f64,
}

impl Default for Weights {
    fn default() -> Weights {
        Weights { state: 1.0, force: 1.0, noise: 1.0, rate: 1.0 }
    }
}

impl Weights {
    /// Q_phi.
    pub fn errors(&self, system: &System) -> DMatrix<f64> {
        let (n, f, _) = system.sizes();
        DMatrix::from_fn(n + f, n + f, |i, j| {
            if i != j {
                0.0
            } else if i < n {
                self.state
            } else {
                self.force
            }
        })
    }
}
