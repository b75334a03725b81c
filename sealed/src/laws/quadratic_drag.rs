//! Drag that grows as the square of the speed.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here, StatedDamper};
use super::families::VISCOUS;
use super::force::ForceLaw;
use crate::draw::sizing::{DRAG, rounded, share};
use crate::network::allowed::Allowed::NotNegative;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// `f = q v abs(v)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QuadraticDrag {
    /// N s2/m2, q.
    pub coefficient: f64,
}

impl ForceLaw for QuadraticDrag {
    fn damping(&self, _: f64, v: f64, _: &[f64]) -> f64 {
        self.coefficient * v.abs()
    }
}

impl Described for QuadraticDrag {
    const NAME: &'static str = "quadratic_drag";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: false, is_linear: false, family: &[VISCOUS] };
    const READ: Read<QuadraticDrag> = Some(|section| Ok(QuadraticDrag { coefficient: section.need_number("coefficient", NotNegative)? }));
    const DRAWS: &'static [Draw] = &[Draw::Body(StatedDamper::Stays)];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("coefficient", self.coefficient, NotNegative)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<QuadraticDrag> {
        let Here::Body(at) = here else { return None };
        Some(QuadraticDrag { coefficient: rounded(share(DRAG, random) * at.force / (at.speed * at.speed)) })
    }
}
