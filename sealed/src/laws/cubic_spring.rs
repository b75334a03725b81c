//! A spring that stiffens.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here, InJoint};
use super::families::ELASTIC;
use super::force::{ForceLaw, Path};
use crate::draw::sizing::{between, rounded};
use crate::network::allowed::Allowed::{Any, NotNegative};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// `f = k x + k3 x^3`: stiffening for k3 > 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CubicSpring {
    /// N/m, k.
    pub stiffness: f64,
    /// N/m3, k3.
    pub cubic: f64,
}

impl ForceLaw for CubicSpring {
    fn path_force(&self, path: &Path, _: &mut [f64]) -> f64 {
        let x = path.to;
        (self.stiffness + self.cubic * x * x) * x
    }

    /// The slope where the cubic part carries as much as the linear one. Farther out the substep is not chosen for it.
    fn stiffness(&self) -> f64 {
        4.0 * self.stiffness
    }
}

impl Described for CubicSpring {
    const NAME: &'static str = "cubic_spring";
    const FACTS: Facts = Facts { takes_energy: false, is_friction: false, is_linear: false, family: &[ELASTIC] };
    const READ: Read<CubicSpring> = Some(|section| {
        Ok(CubicSpring { stiffness: section.need_number("stiffness", NotNegative)?, cubic: section.need_number("cubic", Any)? })
    });
    const DRAWS: &'static [Draw] = &[Draw::Joint(InJoint::ForSpring)];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("stiffness", self.stiffness, NotNegative), ("cubic", self.cubic, Any)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<CubicSpring> {
        let Here::Joint(at) = here else { return None };
        let stiffness = at.stiffness * (1.0 - at.absorbed);
        // At the working stretch the cubic part is 15 to 60 % of the linear one.
        Some(CubicSpring {
            stiffness: rounded(stiffness),
            cubic: rounded(stiffness * between(0.15, 0.6, random) / (at.stretch * at.stretch)),
        })
    }

    const NUMBER_KEYS: &'static [&'static str] = &["stiffness"];

    fn number_mut(&mut self, _key: &str) -> Option<&mut f64> {
        Some(&mut self.stiffness)
    }
}
