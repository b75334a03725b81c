//! Dry friction of one bristle that bends.

use super::bristle::bent;
use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::families::{FRICTION, LOOPS};
use super::force::{ForceLaw, Path};
use crate::draw::sizing::{presliding, rounded};
use crate::network::allowed::Allowed::Positive;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// `dz/dt = v (1 - s z/c sign v)`, `f = s z` (Dahl 1968). Memory: z, m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dahl {
    /// N/m, s.
    pub stiffness: f64,
    /// N, c.
    pub coulomb: f64,
}

impl ForceLaw for Dahl {
    fn memory(&self) -> usize {
        1
    }

    fn path_force(&self, path: &Path, memory: &mut [f64]) -> f64 {
        memory[0] = bent(memory[0], path.to - path.from, self.coulomb / self.stiffness);
        self.stiffness * memory[0]
    }

    /// Just after a reversal from sliding.
    fn stiffness(&self) -> f64 {
        2.0 * self.stiffness
    }
}

impl Described for Dahl {
    const NAME: &'static str = "dahl";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: true, is_linear: false, family: &[FRICTION, LOOPS] };
    const READ: Read<Dahl> = Some(|section| {
        Ok(Dahl { stiffness: section.need_number("stiffness", Positive)?, coulomb: section.need_number("coulomb", Positive)? })
    });
    const DRAWS: &'static [Draw] = &[Draw::Friction { loaded: false }];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("stiffness", self.stiffness, Positive), ("coulomb", self.coulomb, Positive)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<Dahl> {
        let Here::Body(at) = here else { return None };
        Some(Dahl { stiffness: rounded(at.friction / presliding(at.travel, random)), coulomb: at.friction })
    }
}
