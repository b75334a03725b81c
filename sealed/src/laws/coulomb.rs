//! Dry friction of one level.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::families::FRICTION;
use super::force::ForceLaw;
use crate::network::allowed::Allowed::NotNegative;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// `f = c sign(v)`; at rest whatever holds, up to c.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coulomb {
    /// N, c.
    pub force: f64,
}

impl ForceLaw for Coulomb {
    fn dry(&self, _: f64, _: f64, _: &[f64]) -> [f64; 2] {
        [self.force, self.force]
    }

    fn is_dry(&self) -> bool {
        true
    }
}

impl Described for Coulomb {
    const NAME: &'static str = "coulomb";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: true, is_linear: false, family: &[FRICTION] };
    const READ: Read<Coulomb> = Some(|section| Ok(Coulomb { force: section.need_number("force", NotNegative)? }));
    const DRAWS: &'static [Draw] = &[Draw::Friction { loaded: false }];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("force", self.force, NotNegative)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<Coulomb> {
        let Here::Body(at) = here else { return None };
        let _ = random;
        Some(Coulomb { force: at.friction })
    }

    const NUMBER_KEYS: &'static [&'static str] = &["force"];

    fn number_mut(&mut self, _key: &str) -> Option<&mut f64> {
        Some(&mut self.force)
    }
}
