//! A spring with a loop.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here, InJoint};
use super::families::{LOOPS, PRESLIDING};
use super::force::{ForceLaw, Path};
use crate::draw::sizing::{between, rounded, share};
use crate::network::allowed::Allowed::{Any, NotNegative, Positive};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Spring that nears one line while it is stretched and another while it is released (Kuchenbecker and Niemeyer 2005, without the lag behind a ramp).
/// Towards `o± + k± x`, the distance to the line falls by `e^(-bandwidth d)` on a way d.
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

impl Described for HystereticSpring {
    const NAME: &'static str = "hysteretic_spring";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: false, is_linear: false, family: &[PRESLIDING, LOOPS] };
    const READ: Read<HystereticSpring> = Some(|section| {
        Ok(HystereticSpring {
            stiffness_positive: section.need_number("stiffness_positive", NotNegative)?,
            stiffness_negative: section.need_number("stiffness_negative", NotNegative)?,
            offset_positive: section.need_number("offset_positive", Any)?,
            offset_negative: section.need_number("offset_negative", Any)?,
            bandwidth: section.need_number("bandwidth", Positive)?,
        })
    });
    const DRAWS: &'static [Draw] = &[Draw::Joint(InJoint::ForSpring)];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![
            ("stiffness_positive", self.stiffness_positive, NotNegative),
            ("stiffness_negative", self.stiffness_negative, NotNegative),
            ("offset_positive", self.offset_positive, Any),
            ("offset_negative", self.offset_negative, Any),
            ("bandwidth", self.bandwidth, Positive),
        ]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<HystereticSpring> {
        let Here::Joint(at) = here else { return None };
        // A loop of 5 to 20 % of the working force on each side, reached within a third to a twentieth of the working stretch.
        let half = rounded(share([0.05, 0.2], random) * at.force);
        Some(HystereticSpring {
            stiffness_positive: rounded(at.stiffness),
            stiffness_negative: rounded(at.stiffness),
            offset_positive: half,
            offset_negative: -half,
            bandwidth: rounded(between(3.0, 20.0, random) / at.stretch),
        })
    }

    const NUMBER_KEYS: &'static [&'static str] = &["stiffness_positive", "stiffness_negative"];

    fn number_mut(&mut self, key: &str) -> Option<&mut f64> {
        if key == "stiffness_positive" { Some(&mut self.stiffness_positive) } else { Some(&mut self.stiffness_negative) }
    }
}
