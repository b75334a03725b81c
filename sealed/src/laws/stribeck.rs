//! Dry friction that falls with speed.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::families::FRICTION;
use super::force::ForceLaw;
use super::gaussian::between_rest_and_speed;
use crate::draw::sizing::{between, rounded};
use crate::network::allowed::Allowed::{NotNegative, Positive};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// `f = (c + (s - c) exp(-(v/vs)^2)) sign(v)` with s at rest above c.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stribeck {
    /// N, c.
    pub coulomb: f64,
    /// N, s.
    #[serde(rename = "static")]
    pub at_rest: f64,
    /// m/s, vs.
    pub velocity: f64,
}

impl ForceLaw for Stribeck {
    fn dry(&self, v: f64, _: f64, _: &[f64]) -> [f64; 2] {
        let level = between_rest_and_speed(self.at_rest, self.coulomb, v / self.velocity);
        [level, level]
    }

    fn is_dry(&self) -> bool {
        true
    }
}

impl Described for Stribeck {
    const NAME: &'static str = "stribeck";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: true, is_linear: false, family: &[FRICTION] };
    const READ: Read<Stribeck> = Some(|section| {
        Ok(Stribeck {
            coulomb: section.need_number("coulomb", NotNegative)?,
            at_rest: section.need_number("static", NotNegative)?,
            velocity: section.need_number("velocity", Positive)?,
        })
    });
    const DRAWS: &'static [Draw] = &[Draw::Friction { loaded: false }];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("coulomb", self.coulomb, NotNegative), ("static", self.at_rest, NotNegative), ("velocity", self.velocity, Positive)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<Stribeck> {
        let Here::Body(at) = here else { return None };
        Some(Stribeck {
            coulomb: at.friction,
            // Static friction is seldom more than twice the kinetic one.
            at_rest: rounded(at.friction * between(1.3, 2.0, random)),
            // Falls within a part of the working speed: slower it would be lost in a reversal, faster it would be viscous.
            velocity: rounded(at.speed * between(0.03, 0.3, random)),
        })
    }
}
