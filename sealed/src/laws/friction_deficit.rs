//! Dry friction that rises with speed.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::families::FRICTION;
use super::force::ForceLaw;
use super::gaussian::between_rest_and_speed;
use crate::draw::sizing::{between, rounded};
use crate::network::allowed::Allowed::{NotNegative, Positive};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// `f = (c - (c - r) exp(-(v/vs)^2)) sign(v)` with r at rest below c.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionDeficit {
    /// N, c.
    pub coulomb: f64,
    /// N, r.
    pub rest: f64,
    /// m/s, vs.
    pub velocity: f64,
}

impl ForceLaw for FrictionDeficit {
    fn dry(&self, v: f64, _: f64, _: &[f64]) -> [f64; 2] {
        let level = between_rest_and_speed(self.rest, self.coulomb, v / self.velocity);
        [level, level]
    }

    fn is_dry(&self) -> bool {
        true
    }
}

impl Described for FrictionDeficit {
    const NAME: &'static str = "friction_deficit";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: true, is_linear: false, family: &[FRICTION] };
    const READ: Read<FrictionDeficit> = Some(|section| {
        Ok(FrictionDeficit {
            coulomb: section.need_number("coulomb", NotNegative)?,
            rest: section.need_number("rest", NotNegative)?,
            velocity: section.need_number("velocity", Positive)?,
        })
    });
    const DRAWS: &'static [Draw] = &[Draw::Friction { loaded: false }];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("coulomb", self.coulomb, NotNegative), ("rest", self.rest, NotNegative), ("velocity", self.velocity, Positive)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<FrictionDeficit> {
        let Here::Body(at) = here else { return None };
        Some(FrictionDeficit {
            coulomb: at.friction,
            // As for Stribeck, the other way.
            rest: rounded(at.friction / between(1.3, 2.0, random)),
            velocity: rounded(at.speed * between(0.03, 0.3, random)),
        })
    }
}
