//! A spring that goes on yielding.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::families::ELASTIC;
use super::force::{ForceLaw, Path};
use crate::network::allowed::Allowed::{One, Positive};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// A spring k in series with retarded ones: `x = f/k + sum z_i`, `tau_i dz_i/dt = f/k_i - z_i`. Memory: every z_i, m.
///
/// The z_i are carried on by the midpoint rule, in whose middle f and all z_i are solved for together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Creep {
    /// N/m, k.
    pub stiffness: f64,
    /// N/m, k_i.
    pub creep_stiffness: Vec<f64>,
    /// s, tau_i; as many.
    pub time: Vec<f64>,
}

impl ForceLaw for Creep {
    fn memory(&self) -> usize {
        self.time.len()
    }

    fn path_force(&self, path: &Path, memory: &mut [f64]) -> f64 {
        // In the middle z_i = (z_i0 + a_i f/k_i)/(1 + a_i), a_i = h/(2 tau_i), and f = k (x - sum z_i).
        let half = 0.5 * path.duration;
        let branches = || self.creep_stiffness.iter().zip(&self.time).map(|(k, tau)| (1.0 / k, half / tau));
        let (mut left, mut yields) = (0.5 * (path.from + path.to), 1.0 / self.stiffness);
        for ((compliance, a), z) in branches().zip(memory.iter()) {
            left -= z / (1.0 + a);
            yields += compliance * a / (1.0 + a);
        }
        let force = left / yields;
        for ((compliance, a), z) in branches().zip(memory.iter_mut()) {
            let middle = (*z + a * force * compliance) / (1.0 + a);
            *z = 2.0 * middle - *z;
        }
        self.stiffness * (path.to - memory.iter().sum::<f64>())
    }

    fn stiffness(&self) -> f64 {
        self.stiffness
    }
}

impl Described for Creep {
    const NAME: &'static str = "creep";
    const FACTS: Facts =
        Facts { takes_energy: true, is_friction: false, is_linear: false, family: &[&["creep", "series_compliance"], ELASTIC] };
    const READ: Read<Creep> = Some(|section| {
        let stiffness = section.need_number("stiffness", Positive)?;
        let mut list = |key: &str| {
            let list = section.numbers(key, Positive)?;
            list.filter(|list| !list.is_empty()).ok_or_else(|| section.error(key, "missing or empty; add a list of numbers"))
        };
        let creep = Creep { stiffness, creep_stiffness: list("creep_stiffness")?, time: list("time")? };
        if creep.creep_stiffness.len() != creep.time.len() {
            return Err(section.error("time", "expected as many numbers as in creep_stiffness"));
        }
        Ok(creep)
    });
    const DRAWS: &'static [Draw] = &[];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        let same = if self.creep_stiffness.len() == self.time.len() { 1.0 } else { 0.0 };
        let lists =
            self.creep_stiffness.iter().map(|v| ("creep_stiffness", *v, Positive)).chain(self.time.iter().map(|v| ("time", *v, Positive)));
        [("stiffness", self.stiffness, Positive), ("length of time over that of creep_stiffness", same, One)]
            .into_iter()
            .chain(lists)
            .collect()
    }

    fn draw(_: &Here, _: &mut ChaCha8Rng) -> Option<Creep> {
        None
    }
}
