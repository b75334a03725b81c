//! Parallel spring-sliders, each with its own parameters.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::families::{FRICTION, LOOPS};
use super::force::{ForceLaw, Path};
use crate::draw::sizing::{presliding, rounded};
use crate::network::allowed::Allowed::{One, Positive};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Parallel spring-sliders (Iwan 1966): `f = sum k_i z_i`, each z_i follows the displacement and stays within `±f_i/k_i`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaxwellSlip {
    /// N/m, k_i.
    pub stiffness: Vec<f64>,
    /// N, f_i; as many.
    pub force: Vec<f64>,
}

impl ForceLaw for MaxwellSlip {
    fn memory(&self) -> usize {
        self.stiffness.len()
    }

    fn path_force(&self, path: &Path, memory: &mut [f64]) -> f64 {
        slide(&self.stiffness, &self.force, 1.0, path, memory)
    }

    fn stiffness(&self) -> f64 {
        self.stiffness.iter().sum()
    }
}

impl Described for MaxwellSlip {
    const NAME: &'static str = "maxwell_slip";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: true, is_linear: false, family: &[FRICTION, LOOPS] };
    const READ: Read<MaxwellSlip> = Some(|section| {
        let mut list = |key: &str| {
            let list = section.numbers(key, Positive)?;
            list.filter(|list| !list.is_empty()).ok_or_else(|| section.error(key, "missing or empty; add a list of numbers"))
        };
        let sliders = MaxwellSlip { stiffness: list("stiffness")?, force: list("force")? };
        if sliders.stiffness.len() != sliders.force.len() {
            return Err(section.error("force", "expected as many numbers as in stiffness"));
        }
        Ok(sliders)
    });
    const DRAWS: &'static [Draw] = &[Draw::Friction { loaded: false }];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        let lists = self.stiffness.iter().map(|v| ("stiffness", *v, Positive)).chain(self.force.iter().map(|v| ("force", *v, Positive)));
        let same = if self.stiffness.len() == self.force.len() { 1.0 } else { 0.0 };
        std::iter::once(("length of force over that of stiffness", same, One)).chain(lists).collect()
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<MaxwellSlip> {
        let Here::Body(at) = here else { return None };
        // Three to five sliders that slip one after the other between 0.2 and 3 times the way of presliding.
        let way = presliding(at.travel, random);
        let count = random.random_range(3..=5);
        let shares: Vec<f64> = (0..count).map(|_| random.random_range(0.5..=1.5)).collect();
        let sum: f64 = shares.iter().sum();
        let force: Vec<f64> = shares.iter().map(|share| rounded(at.friction * share / sum)).collect();
        let lets_go = |i: usize| way * 0.2 * 15.0_f64.powf(i as f64 / (count - 1) as f64);
        let stiffness = force.iter().enumerate().map(|(i, force)| rounded(force / lets_go(i))).collect();
        Some(MaxwellSlip { stiffness, force })
    }
}

/// Carries the deflections (m) along the path and adds their forces; break-away forces are multiplied by `level`.
pub(super) fn slide(stiffness: &[f64], force: &[f64], level: f64, path: &Path, deflection: &mut [f64]) -> f64 {
    let moved = path.to - path.from;
    let mut total = 0.0;
    for ((k, f), z) in stiffness.iter().zip(force).zip(deflection) {
        let most = level * f / k;
        *z = (*z + moved).clamp(-most, most);
        total += k * *z;
    }
    total
}
