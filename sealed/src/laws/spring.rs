//! A linear spring.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::families::ELASTIC;
use super::force::{ForceLaw, Path};
use crate::network::allowed::Allowed::{Any, NotNegative};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// `f = k (x - rest)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spring {
    /// N/m, k.
    pub stiffness: f64,
    /// m, displacement without force.
    #[serde(default)]
    pub rest: f64,
}

impl ForceLaw for Spring {
    fn path_force(&self, path: &Path, _: &mut [f64]) -> f64 {
        self.stiffness * (path.to - self.rest)
    }

    fn stiffness(&self) -> f64 {
        self.stiffness
    }
}

impl Described for Spring {
    const NAME: &'static str = "spring";
    const FACTS: Facts = Facts { takes_energy: false, is_friction: false, is_linear: true, family: &[ELASTIC] };
    const READ: Read<Spring> = Some(|section| {
        Ok(Spring { stiffness: section.need_number("stiffness", NotNegative)?, rest: section.number("rest", Any)?.unwrap_or(0.0) })
    });
    const DRAWS: &'static [Draw] = &[];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("stiffness", self.stiffness, NotNegative), ("rest", self.rest, Any)]
    }

    fn draw(_: &Here, _: &mut ChaCha8Rng) -> Option<Spring> {
        None
    }

    const NUMBER_KEYS: &'static [&'static str] = &["stiffness"];

    fn number_mut(&mut self, _key: &str) -> Option<&mut f64> {
        Some(&mut self.stiffness)
    }
}
