//! A damper that depends on the direction.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here, StatedDamper};
use super::families::VISCOUS;
use super::force::ForceLaw;
use crate::draw::sizing::{DRAG, between, rounded, share};
use crate::network::allowed::Allowed::NotNegative;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// `f = b+ v` forwards, `b- v` backwards.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AsymmetricDamper {
    /// N s/m, b+.
    pub positive: f64,
    /// N s/m, b-.
    pub negative: f64,
}

impl ForceLaw for AsymmetricDamper {
    fn damping(&self, _: f64, v: f64, _: &[f64]) -> f64 {
        if v >= 0.0 { self.positive } else { self.negative }
    }
}

impl Described for AsymmetricDamper {
    const NAME: &'static str = "asymmetric_damper";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: false, is_linear: false, family: &[VISCOUS] };
    const READ: Read<AsymmetricDamper> = Some(|section| {
        Ok(AsymmetricDamper {
            positive: section.need_number("positive", NotNegative)?,
            negative: section.need_number("negative", NotNegative)?,
        })
    });
    const DRAWS: &'static [Draw] = &[Draw::Body(StatedDamper::IsReplaced)];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("positive", self.positive, NotNegative), ("negative", self.negative, NotNegative)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<AsymmetricDamper> {
        let Here::Body(at) = here else { return None };
        // Beside what the model states; one direction carries 1.5 to 3 times the other.
        let (more, ratio) = (share(DRAG, random) * at.force / at.speed, between(1.5, 3.0, random));
        let (high, low) = (rounded(at.stated_damping + more), rounded((at.stated_damping + more) / ratio));
        let [positive, negative] = if random.random_bool(0.5) { [high, low] } else { [low, high] };
        Some(AsymmetricDamper { positive, negative })
    }
}
