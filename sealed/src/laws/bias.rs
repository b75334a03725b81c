//! A constant force.

use super::around::Around;
use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here, StatedDamper};
use super::force::{ForceLaw, Path};
use crate::effects::answer::Answer;
use crate::effects::site::{GROUND, Site};
use crate::network::allowed::Allowed::Any;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// A constant force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bias {
    /// N.
    pub force: f64,
}

impl ForceLaw for Bias {
    fn path_force(&self, _: &Path, _: &mut [f64]) -> f64 {
        self.force
    }
}

impl Described for Bias {
    const NAME: &'static str = "bias";
    const FACTS: Facts = Facts { takes_energy: false, is_friction: false, is_linear: true, family: &[&["bias", "asymmetric_coulomb"]] };
    const READ: Read<Bias> = Some(|section| Ok(Bias { force: section.need_number("force", Any)? }));
    const DRAWS: &'static [Draw] = &[Draw::Body(StatedDamper::Stays)];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("force", self.force, Any)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<Bias> {
        let Here::Body(at) = here else { return None };
        // A weight or a spring under tension that was not balanced.
        Some(Bias { force: if random.random_bool(0.5) { at.friction } else { -at.friction } })
    }

    fn same_as(&self, around: &Around) -> Vec<Answer> {
        let Site::Between(ends) = &around.site else { return Vec::new() };
        let bias = |between: [String; 2]| Answer::at(&Site::Between(between), &["bias"]);
        let mut all = Vec::new();
        if around.stated.contains(&"coulomb") {
            all.push(Answer::at(&around.site, &["asymmetric_coulomb"]));
        }
        // A constant force on a body is the same whether the ground takes the reaction or a body whose motion is prescribed, as the hand's.
        if let Some(body) = ends.iter().find(|end| *end != GROUND).filter(|_| around.site.is_at_ground()) {
            all.extend(around.moved.iter().map(|hand| bias([body.clone(), hand.clone()])));
        }
        // Where the reaction is taken by the body that the hand's spring holds, a hand at another position explains it too; an unmeasured one may be
        // there.
        for (_, held) in around.grip_ends.iter().filter(|(kind, _)| *kind == "spring") {
            let other = |name: &str| ends.iter().find(|end| *end == name).and_then(|_| ends.iter().find(|end| *end != name));
            if held == GROUND || around.moved.contains(held) {
                continue;
            }
            let same = match (other(GROUND), other(held)) {
                (Some(body), _) if body != held => [body.clone(), held.clone()],
                (None, Some(body)) => [body.clone(), GROUND.to_string()],
                _ => continue,
            };
            all.push(Answer { hand_hidden: true, ..bias(same) });
        }
        if around.site.is_at_ground() && around.gripped_by.contains(&"spring") {
            all.push(Answer { hand_hidden: true, ..Answer::at(&around.site, &["parameters", "none"]) });
        }
        all
    }
}
