//! Dry friction of one bristle, with a level that falls with speed, and damping.

use super::bristle::bent;
use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::families::{FRICTION, LOOPS};
use super::force::{ForceLaw, Path};
use super::gaussian::between_rest_and_speed;
use crate::draw::sizing::{between, presliding, rounded};
use crate::network::allowed::Allowed::{NotNegative, One, Positive};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// `dz/dt = v - s abs(v) z/g(v)`, `f = s z + d dz/dt`, `g = c + (h - c) exp(-(v/vs)^2)` (Canudas de Wit and others 1995), without
/// the viscous term. Memory: z, m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lugre {
    /// N/m, s.
    pub stiffness: f64,
    /// N s/m, d.
    pub damping: f64,
    /// N, c.
    pub coulomb: f64,
    /// N, h, at least c.
    #[serde(rename = "static")]
    pub at_rest: f64,
    /// m/s, vs.
    pub velocity: f64,
}

impl Lugre {
    fn level(&self, v: f64) -> f64 {
        between_rest_and_speed(self.at_rest, self.coulomb, v / self.velocity)
    }
}

impl ForceLaw for Lugre {
    fn memory(&self) -> usize {
        1
    }

    fn path_force(&self, path: &Path, memory: &mut [f64]) -> f64 {
        memory[0] = bent(memory[0], path.to - path.from, self.level(path.speed) / self.stiffness);
        self.stiffness * memory[0]
    }

    /// `dz/dt` over v, times d.
    fn damping(&self, _: f64, v: f64, memory: &[f64]) -> f64 {
        let sign = if v == 0.0 { 0.0 } else { v.signum() };
        self.damping * (1.0 - sign * self.stiffness * memory[0] / self.level(v))
    }

    fn stiffness(&self) -> f64 {
        2.0 * self.stiffness
    }
}

impl Described for Lugre {
    const NAME: &'static str = "lugre";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: true, is_linear: false, family: &[FRICTION, LOOPS] };
    const READ: Read<Lugre> = Some(|section| {
        let (stiffness, damping) = (section.need_number("stiffness", Positive)?, section.need_number("damping", NotNegative)?);
        let (coulomb, at_rest, velocity) = (
            section.need_number("coulomb", Positive)?,
            section.need_number("static", Positive)?,
            section.need_number("velocity", Positive)?,
        );
        if at_rest < coulomb {
            return Err(section.error("static", format!("expected at least coulomb, {coulomb}")));
        }
        Ok(Lugre { stiffness, damping, coulomb, at_rest, velocity })
    });
    const DRAWS: &'static [Draw] = &[Draw::Friction { loaded: false }];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![
            ("stiffness", self.stiffness, Positive),
            ("damping", self.damping, NotNegative),
            ("coulomb", self.coulomb, Positive),
            ("static", self.at_rest / self.coulomb, One),
            ("velocity", self.velocity, Positive),
        ]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<Lugre> {
        let Here::Body(at) = here else { return None };
        let stiffness = at.friction / presliding(at.travel, random);
        // The bristles' own vibration of the body is damped by 10 to 60 % of critical.
        let critical = 2.0 * (stiffness * at.inertia).sqrt();
        Some(Lugre {
            stiffness: rounded(stiffness),
            damping: rounded(critical * between(0.1, 0.6, random)),
            coulomb: at.friction,
            at_rest: rounded(at.friction * between(1.2, 1.8, random)),
            velocity: rounded(at.speed * between(0.05, 0.3, random)),
        })
    }
}
