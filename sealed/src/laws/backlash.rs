//! A shaft behind a gap with sharp ends.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here, InJoint};
use super::families::ELASTIC;
use super::force::{ForceLaw, Path};
use crate::draw::sizing::{between, rounded};
use crate::network::allowed::Allowed::{NotNegative, Positive};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Shaft with inner damping behind a gap (Nordin, Galic' and Gutman 1997): the place `y` of the shaft's end within the gap moves by
/// `dy/dt = dx/dt + (k/c)(x - y)` and stops at `±gap/2`; `f = k (x - y) + c (dx/dt - dy/dt)`. Between the stops that force is zero.
///
/// Where x moves by d in a time h, the twist x - y decays by `exp(-k h/c)`, which is how y is carried on: exact away from the stops.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backlash {
    /// m, whole width.
    pub gap: f64,
    /// N/m, k.
    pub stiffness: f64,
    /// N s/m, c.
    pub damping: f64,
}

impl ForceLaw for Backlash {
    fn memory(&self) -> usize {
        1
    }

    fn path_force(&self, path: &Path, memory: &mut [f64]) -> f64 {
        let twist = (path.from - memory[0]) * (-self.stiffness * path.duration / self.damping).exp();
        let free = path.to - twist;
        let half = 0.5 * self.gap;
        memory[0] = free.clamp(-half, half);
        if free.abs() < half { 0.0 } else { self.stiffness * (path.to - memory[0]) }
    }

    fn damping(&self, _: f64, _: f64, memory: &[f64]) -> f64 {
        if memory[0].abs() < 0.5 * self.gap { 0.0 } else { self.damping }
    }

    fn stiffness(&self) -> f64 {
        self.stiffness
    }
}

impl Described for Backlash {
    const NAME: &'static str = "backlash";
    const FACTS: Facts = Facts { takes_energy: false, is_friction: false, is_linear: false, family: &[ELASTIC, &["series_compliance"]] };
    const READ: Read<Backlash> = Some(|section| {
        Ok(Backlash {
            gap: section.need_number("gap", NotNegative)?,
            stiffness: section.need_number("stiffness", Positive)?,
            damping: section.need_number("damping", NotNegative)?,
        })
    });
    const DRAWS: &'static [Draw] = &[Draw::Joint(InJoint::ForSpringAndDampers)];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("gap", self.gap, NotNegative), ("stiffness", self.stiffness, Positive), ("damping", self.damping, NotNegative)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<Backlash> {
        let Here::Joint(at) = here else { return None };
        Some(Backlash {
            gap: rounded(2.0 * at.stretch * between(0.1, 0.6, random)),
            stiffness: rounded(at.stiffness * (1.0 + at.absorbed)),
            damping: rounded(at.damping),
        })
    }
}
