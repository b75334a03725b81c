//! A linear damper.

use super::around::Around;
use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here, StatedDamper};
use super::families::VISCOUS;
use super::force::ForceLaw;
use crate::draw::sizing::{DRAG, rounded, share};
use crate::effects::answer::Answer;
use crate::effects::site::Site;
use crate::network::allowed::Allowed::NotNegative;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// `f = b v`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Damper {
    /// N s/m, b.
    pub damping: f64,
}

impl ForceLaw for Damper {
    fn damping(&self, _: f64, _: f64, _: &[f64]) -> f64 {
        self.damping
    }
}

impl Described for Damper {
    const NAME: &'static str = "damper";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: false, is_linear: true, family: &[VISCOUS] };
    const READ: Read<Damper> = Some(|section| Ok(Damper { damping: section.need_number("damping", NotNegative)? }));
    const DRAWS: &'static [Draw] = &[Draw::Body(StatedDamper::Refuses)];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("damping", self.damping, NotNegative)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<Damper> {
        let Here::Body(at) = here else { return None };
        Some(Damper { damping: rounded(share(DRAG, random) * at.force / at.speed) })
    }

    /// A motor that loses force to its speed is a damper to ground, and so is a hand's, where its damper is not known.
    fn same_as(&self, around: &Around) -> Vec<Answer> {
        if !around.site.is_at_ground() {
            return Vec::new();
        }
        let motors = around.force_inputs.iter().filter(|(_, body)| around.site.has_end(body));
        let mut all: Vec<Answer> = motors.map(|(input, _)| Answer::at(&Site::Signal(input.clone()), &["back_emf"])).collect();
        if around.gripped_by.contains(&"damper") {
            all.push(Answer { hand_hidden: true, ..Answer::at(&around.site, &["parameters"]) });
        }
        all
    }

    const NUMBER_KEYS: &'static [&'static str] = &["damping"];

    fn number_mut(&mut self, _key: &str) -> Option<&mut f64> {
        Some(&mut self.damping)
    }
}
