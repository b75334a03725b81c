//! Dry friction under the force of a joint.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::families::FRICTION;
use super::force::{ForceLaw, Load};
use crate::draw::sizing::{between, rounded};
use crate::network::allowed::Allowed::NotNegative;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Coulomb friction of surfaces that a joint's spring presses together: `c = c0 + mu abs(f_joint)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadFriction {
    /// N, c0, without load.
    pub force: f64,
    /// mu, friction per load; it holds how the joint's force turns into a normal force (a wrap angle, a gear's pressure angle).
    pub coefficient: f64,
    /// The element whose force is the load; model files name none and mean the joint that the friction sits in ([`Load::Joint`]).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
}

impl ForceLaw for LoadFriction {
    fn dry(&self, _: f64, load: f64, _: &[f64]) -> [f64; 2] {
        let level = self.force + self.coefficient * load.abs();
        [level, level]
    }

    fn is_dry(&self) -> bool {
        true
    }

    fn load(&self) -> Load<'_> {
        self.joint.as_deref().map_or(Load::Joint, Load::Element)
    }
}

impl Described for LoadFriction {
    const NAME: &'static str = "load_friction";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: true, is_linear: false, family: &[&["load_friction"], FRICTION] };
    const READ: Read<LoadFriction> = Some(|section| {
        let (force, coefficient) = (section.need_number("force", NotNegative)?, section.need_number("coefficient", NotNegative)?);
        Ok(LoadFriction { force, coefficient, joint: None })
    });
    const DRAWS: &'static [Draw] = &[Draw::Friction { loaded: true }];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("force", self.force, NotNegative), ("coefficient", self.coefficient, NotNegative)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<LoadFriction> {
        let Here::Body(at) = here else { return None };
        // At the joint's working force the load's part is one to three times the part without load.
        let joint = at.joint.as_ref()?;
        let load = joint.force?;
        let part = between(1.0, 3.0, random);
        Some(LoadFriction {
            force: rounded(at.friction / (1.0 + part)),
            coefficient: rounded(at.friction * part / (1.0 + part) / load),
            joint: Some(joint.name.clone()),
        })
    }

    /// Under a load that changes little it is Coulomb friction.
    fn names(_at_ground: bool) -> Vec<&'static str> {
        vec!["load_friction", "coulomb"]
    }
}
