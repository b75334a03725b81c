//! A ripple fixed to the position.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here, StatedDamper};
use super::force::{ForceLaw, Path};
use crate::draw::sizing::{RIPPLE, between, rounded, share};
use crate::network::allowed::Allowed::{Any, Positive};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// `f = a sin(2 pi x/period + phase)`: a ripple fixed to the position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cogging {
    /// N, a.
    pub amplitude: f64,
    /// m.
    pub period: f64,
    /// rad.
    pub phase: f64,
}

impl ForceLaw for Cogging {
    fn path_force(&self, path: &Path, _: &mut [f64]) -> f64 {
        self.amplitude * (2.0 * PI * path.to / self.period + self.phase).sin()
    }

    fn stiffness(&self) -> f64 {
        2.0 * PI * (self.amplitude / self.period).abs()
    }
}

impl Described for Cogging {
    const NAME: &'static str = "cogging";
    const FACTS: Facts = Facts { takes_energy: false, is_friction: false, is_linear: false, family: &[&["cogging"]] };
    const READ: Read<Cogging> = Some(|section| {
        Ok(Cogging {
            amplitude: section.need_number("amplitude", Any)?,
            period: section.need_number("period", Positive)?,
            phase: section.need_number("phase", Any)?,
        })
    });
    const DRAWS: &'static [Draw] = &[Draw::Body(StatedDamper::Stays)];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("amplitude", self.amplitude, Any), ("period", self.period, Positive), ("phase", self.phase, Any)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<Cogging> {
        let Here::Body(at) = here else { return None };
        Some(Cogging {
            amplitude: rounded(share(RIPPLE, random) * at.force),
            // Two to ten ripples on the travel: fewer are a spring, more a noise.
            period: rounded(2.0 * at.travel / between(2.0, 10.0, random)),
            phase: rounded(random.random_range(0.0..2.0 * PI)),
        })
    }
}
