//! Dry friction of a level for each direction.

use super::around::Around;
use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::families::FRICTION;
use super::force::ForceLaw;
use crate::draw::sizing::{between, rounded};
use crate::effects::answer::Answer;
use crate::network::allowed::Allowed::NotNegative;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// `f = c+` forwards, `-c-` backwards.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AsymmetricCoulomb {
    /// N, c+.
    pub positive: f64,
    /// N, c-.
    pub negative: f64,
}

impl ForceLaw for AsymmetricCoulomb {
    fn dry(&self, _: f64, _: f64, _: &[f64]) -> [f64; 2] {
        [self.positive, self.negative]
    }

    fn is_dry(&self) -> bool {
        true
    }
}

impl Described for AsymmetricCoulomb {
    const NAME: &'static str = "asymmetric_coulomb";
    const FACTS: Facts = Facts { takes_energy: true, is_friction: true, is_linear: false, family: &[FRICTION] };
    const READ: Read<AsymmetricCoulomb> = Some(|section| {
        Ok(AsymmetricCoulomb {
            positive: section.need_number("positive", NotNegative)?,
            negative: section.need_number("negative", NotNegative)?,
        })
    });
    const DRAWS: &'static [Draw] = &[Draw::Friction { loaded: false }];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        vec![("positive", self.positive, NotNegative), ("negative", self.negative, NotNegative)]
    }

    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<AsymmetricCoulomb> {
        let Here::Body(at) = here else { return None };
        // One direction carries 1.3 to 2.5 times the other: less is hardly asymmetric.
        let ratio = between(1.3, 2.5, random).sqrt();
        let (high, low) = (rounded(at.friction * ratio), rounded(at.friction / ratio));
        let [positive, negative] = if random.random_bool(0.5) { [high, low] } else { [low, high] };
        Some(AsymmetricCoulomb { positive, negative })
    }

    /// Asymmetric friction is friction with a bias. Where the model states the friction, the bias alone is what it leaves out.
    fn same_as(&self, around: &Around) -> Vec<Answer> {
        let together_with = if around.replaces_something { Vec::new() } else { vec!["coulomb".to_string()] };
        vec![Answer { together_with, ..Answer::at(&around.site, &["bias"]) }]
    }
}
