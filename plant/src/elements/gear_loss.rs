//! Friction of a gear or screw in proportion to the force that it passes on, by the direction in which power flows.

use super::harmonic;
use super::kind::{KindOf, Parameter, Range};
use super::law::{FrictionLaw, Linear, Rubbing, Side};
use super::sine::Sine;

/// `f = (1/efficiency - 1) |load| sign(v)` where the element's bodies drive the joint, `(1 - back_efficiency) |load| sign(v)` where the joint drives
/// them; set-valued at rest. The load is the force of the joint, see [`crate::load`].
///
/// At constant speed the joint gets `efficiency` of the force that drives the bodies, and the bodies `back_efficiency` of the joint's force where it
/// drives them. With a `back_efficiency` of 0 or below no force of the joint moves them: self-locking. Without load there is no loss, so linearised it
/// is nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct GearLoss {
    /// Above 0, at most 1.
    pub efficiency: f64,
    /// At most 1; 0 or below locks.
    pub back_efficiency: f64,
}

impl GearLoss {
    pub(super) const KIND: KindOf<GearLoss> = KindOf {
        name: "gear_loss",
        equation: "f = (1/η - 1) |load| sign(v) driving the joint, (1 - η_b) |load| sign(v) driven by it, set-valued at rest",
        source: "Pelchen, Schweiger & Otter 2002",
        energy: "dissipates, creates none",
        parameters: &[
            Parameter::number("efficiency", "-", Range::Positive, "η, driving the joint, at most 1"),
            Parameter::number("back_efficiency", "-", Range::Any, "η_b, driven by the joint, at most 1; self-locking at 0 and below"),
        ],
        build: |v| {
            let (efficiency, back_efficiency) = (v[0][0], v[1][0]);
            for (key, value) in [("efficiency", efficiency), ("back_efficiency", back_efficiency)] {
                if value > 1.0 {
                    return Err(format!("{key} must be at most 1, not {value}"));
                }
            }
            Ok(GearLoss { efficiency, back_efficiency })
        },
    };

    pub(super) fn values(&self) -> Vec<Vec<f64>> {
        vec![vec![self.efficiency], vec![self.back_efficiency]]
    }
}

impl FrictionLaw for GearLoss {
    #[inline]
    fn level(&self, at: &Rubbing) -> f64 {
        let drives = match at.side {
            Side::Forwards => at.load > 0.0,
            Side::Backwards => at.load < 0.0,
        };
        let share = if drives { 1.0 / self.efficiency - 1.0 } else { 1.0 - self.back_efficiency };
        share * at.load.abs()
    }

    fn linearised(&self, at: &Sine) -> Linear {
        harmonic::of_friction(self, at)
    }
}
