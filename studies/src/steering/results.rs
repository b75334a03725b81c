//! Everything that the page and the table show.

use super::bench::{Curve, Recorded};
use super::identify::Fit;

/// Everything that the page shows.
pub(super) struct Results {
    /// Measured on the rig: the design, the device of Table II, and of Table III at each scale of stroke.
    pub design: Vec<Curve>,
    pub friction: Vec<Curve>,
    pub whole: Vec<(f64, Vec<Curve>)>,
    pub design_fit: Fit,
    pub friction_fit: Fit,
    /// Table II's model, fitted to the device with backlash up to 20 Hz: the paper's step before it knew of the gap.
    pub without_gap: Fit,
    pub run_1: Fit,
    pub run_2: Fit,
    /// (scale, stiffness without the gap, with it).
    pub bias: Vec<(f64, f64, f64)>,
    /// Time responses with SAE-10: recorded, and the force of the fitted model under the recorded displacement.
    pub times: Vec<(f64, Recorded, Vec<f64>)>,
    /// The device with hysteretic friction on the rig: its curve, what friction without and with presliding makes of it, its run at 0.1 Hz.
    pub hysteretic: Curve,
    pub sudden_fit: Fit,
    pub refined_fit: Fit,
    pub slow: (Recorded, Vec<f64>, Vec<f64>),
}

/// Strokes of a scale in words.
pub(super) fn strokes(scale: f64) -> String {
    format!("{} to {} mm", 10.0 * scale, scale)
}
