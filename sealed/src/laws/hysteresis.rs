//! A spring with a loop.

use super::{ForceLaw, Path};
use serde::{Deserialize, Serialize};

/// Spring that nears one line while it is stretched and another while it is let go (Kuchenbecker and Niemeyer 2005, with the lag
/// behind a ramp taken away): towards `o± + k± x`, the distance to the line falls by `e^(-bandwidth d)` on a way d.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HystereticSpring {
    /// N/m, k+, slope of the line while x rises.
    pub stiffness_positive: f64,
    /// N/m, k-, slope of the line while x falls.
    pub stiffness_negative: f64,
    /// N, o+, of the rising line at x = 0.
    pub offset_positive: f64,
    /// N, o-, of the falling line at x = 0, with its sign.
    pub offset_negative: f64,
    /// rad/m.
    pub bandwidth: f64,
}

impl ForceLaw for HystereticSpring {
    fn memory(&self) -> usize {
        1
    }

    fn path_force(&self, path: &Path, memory: &mut [f64]) -> f64 {
        let moved = path.to - path.from;
        let (offset, slope) =
            if moved >= 0.0 { (self.offset_positive, self.stiffness_positive) } else { (self.offset_negative, self.stiffness_negative) };
        let away = memory[0] - (offset + slope * path.from);
        memory[0] = offset + slope * path.to + away * (-self.bandwidth * moved.abs()).exp();
        memory[0]
    }

    /// On the turn from one line to the other, at the place where they are apart as at x = 0.
    fn stiffness(&self) -> f64 {
        let apart = (self.offset_positive - self.offset_negative).abs();
        self.stiffness_positive.max(self.stiffness_negative) + self.bandwidth * apart
    }
}
