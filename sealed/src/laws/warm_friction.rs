//! Dry friction that its own heat lowers.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::families::FRICTION;
use super::force::ForceLaw;
use crate::draw::sizing::{between, rounded};
use crate::network::allowed::Allowed::{NotNegative, Positive};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Coulomb friction that falls as the rubbing parts warm: `c(T) = c0/(1 + T/T_half)`, with the warming T above the surroundings fed by
/// the friction's own power and cooling with a time constant: `dT/dt = c abs(v)/C - T/tau`.
///
/// The form is that of a lubricant whose viscosity falls with temperature, to first order. Memory: T, K.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WarmFriction {
    /// N, c0, cold.
    pub force: f64,
    /// K, T_half: the warming that halves the friction.
    pub half_warming: f64,
    /// J/K, C.
    pub heat_capacity: f64,
    /// s, tau.
    pub cooling_time: f64,
}

impl WarmFriction {
    /// N, friction after rubbing for long at speed `v` (m/s): c that solves `c (1 + c beta) = c0`, `beta = abs(v) tau/(C T_half)`.
    pub fn steady(&self, v: f64) -> f64 {
        let beta = v.abs() * self.cooling_time / (self.heat_capacity * self.half_warming);
        2.0 * self.force / (1.0 + (1.0 + 4.0 * beta * self.force).sqrt())
    }
}

impl ForceLaw for WarmFriction {
    fn memory(&self) -> usize {
        1
    }

    fn dry(&self, _: f64, _: f64, memory: &[f64]) -> [f64; 2] {
        let level = self.force / (1.0 + memory[0] / self.half_warming);
        [level, level]
    }

    fn is_dry(&self) -> bool {
        true
    }

    /// Exact for a power that is constant over the time.
    fn after(&self, friction: f64, v: f64, duration: f64, memory: &mut [f64]) {
        let steady = (friction * v).max(0.0) * self.cooling_time / self.heat_capacity;
        memory[0] = steady + (memory[0] - steady) * (-duration / self.cooling_time).exp();
    }
}

impl Described for WarmFriction {
    const NAME: &'static str = "warm_friction";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: true, is_linear: false, family: &[&["warm_friction"], FRICTION] };
    /// Model files have the heat that halves the friction, `C T_half`, which is all that shows.
    const READ: Read<WarmFriction> = Some(|section| {
        let (force, half_heat) = (section.need_number("force", NotNegative)?, section.need_number("half_heat", Positive)?);
        let cooling_time = section.need_number("cooling_time", Positive)?;
        Ok(WarmFriction { force, half_warming: 1.0, heat_capacity: half_heat, cooling_time })
    });
    const DRAWS: &'static [Draw] = &[Draw::Friction { loaded: false }];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![
            ("force", self.force, NotNegative),
            ("half_warming", self.half_warming, Positive),
            ("heat_capacity", self.heat_capacity, Positive),
            ("cooling_time", self.cooling_time, Positive),
        ]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<WarmFriction> {
        let Here::Body(at) = here else { return None };
        // The power of steady work warms the joint by 0.5 to 2 of the half-warming within 2 to 20 s: a session of a minute sees it change.
        let cooling_time = between(2.0, 20.0, random);
        let half_warming = between(10.0, 40.0, random);
        let power = at.friction * at.speed * 2.0 / PI;
        let heat_capacity = power * cooling_time / (half_warming * between(0.5, 2.0, random));
        Some(WarmFriction {
            force: at.friction,
            half_warming: rounded(half_warming),
            heat_capacity: rounded(heat_capacity),
            cooling_time: rounded(cooling_time),
        })
    }

    /// Heat lowers friction where it is fast: over a recording that is dry friction, falling with speed where it shows.
    fn names(_at_ground: bool) -> Vec<&'static str> {
        vec!["warm_friction", "coulomb", "stribeck"]
    }
}
