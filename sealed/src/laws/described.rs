//! A law's description of itself: its name in files, its sort, how it is drawn, and what a verdict may call it.

use super::around::Around;
use super::draw::{Draw, Here};
use super::force::ForceLaw;
use crate::effects::answer::Answer;
use crate::network::allowed::Allowed;
use crate::network::section::{NetworkError, Section};
use rand_chacha::ChaCha8Rng;

/// A number's key, its value, and what it must be.
pub(crate) type Checked = (&'static str, f64, Allowed);

/// Reads a law's numbers from an element of a model file; `None` of a form that no model file has.
pub(crate) type Read<L> = Option<fn(&mut Section) -> Result<L, NetworkError>>;

/// What sort of law it is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Facts {
    /// Whether it takes energy out of what moves.
    pub takes_energy: bool,
    /// Whether it is dry friction, or friction that bends before it slides.
    pub is_friction: bool,
    /// Whether a linear model can imitate it exactly, from wherever it rests.
    pub is_linear: bool,
    /// Names of effects of the same family, in the vocabulary of verdicts, in lists.
    pub family: &'static [&'static [&'static str]],
}

/// A law of force; its file implements this and [`ForceLaw`].
pub(crate) trait Described: Sized {
    /// Its name, as model files and truths write it.
    const NAME: &'static str;
    /// What sort of law it is.
    const FACTS: Facts;
    /// How it is read.
    const READ: Read<Self>;
    /// Where it is drawn as a hidden effect; empty where it is not.
    const DRAWS: &'static [Draw];
    /// Keys of the parameters that a nominal model may have wrong.
    const NUMBER_KEYS: &'static [&'static str] = &[];

    /// Its equations, ready to step.
    fn to_force(&self) -> Box<dyn ForceLaw>;

    /// Its parameters, and the ranges that its equations accept.
    fn numbers(&self) -> Vec<Checked>;

    /// A law of a size that shows here, at one of the places of `DRAWS`; `None` where the device does not move there.
    fn draw(here: &Here, random: &mut ChaCha8Rng) -> Option<Self>;

    /// The names that verdicts have for it: its own, or for a form of the hidden plant's own the nearest ones.
    fn names(_at_ground: bool) -> Vec<&'static str> {
        vec![Self::NAME]
    }

    /// Answers that are right beside its own names at its own place, because nothing distinguishes them.
    fn same_as(&self, _around: &Around) -> Vec<Answer> {
        Vec::new()
    }

    /// The number under one of `NUMBER_KEYS`.
    fn number_mut(&mut self, _key: &str) -> Option<&mut f64> {
        None
    }
}
