//! Inertia between two bodies.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::force::ForceLaw;
use crate::network::allowed::Allowed::NotNegative;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// `f = m dv/dt`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inerter {
    /// kg.
    pub inertance: f64,
}

impl ForceLaw for Inerter {
    fn inertance(&self) -> f64 {
        self.inertance
    }
}

impl Described for Inerter {
    const NAME: &'static str = "inerter";
    const FACTS: Facts = Facts { takes_energy: false, is_friction: false, is_linear: true, family: &[&["inerter", "inertia"]] };
    const READ: Read<Inerter> = Some(|section| Ok(Inerter { inertance: section.need_number("inertance", NotNegative)? }));
    const DRAWS: &'static [Draw] = &[];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("inertance", self.inertance, NotNegative)]
    }

    fn draw(_: &Here, _: &mut ChaCha8Rng) -> Option<Inerter> {
        None
    }

    fn names(at_ground: bool) -> Vec<&'static str> {
        if at_ground { vec!["inerter", "inertia"] } else { vec!["inerter"] }
    }

    const NUMBER_KEYS: &'static [&'static str] = &["inertance"];

    fn number_mut(&mut self, _key: &str) -> Option<&mut f64> {
        Some(&mut self.inertance)
    }
}
