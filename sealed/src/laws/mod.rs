//! The laws of force between two bodies: those that model files name and those that only a hidden plant has.
//!
//! A law is one file, which holds its whole description (`described::Described`), and one line here. The modules are declared by that line, where
//! `cargo fmt` does not see them: format a law's file with `rustfmt --edition 2024 --config-path . sealed/src/laws/LAW.rs`.

pub(crate) mod around;
mod bristle;
pub(crate) mod described;
pub(crate) mod draw;
pub(crate) mod families;
mod force;
mod gaussian;

pub use bristle_field::LaidField;
pub use force::{ForceLaw, Load, Path};

use crate::effects::answer::Answer;
use crate::network::section::{NetworkError, Section};
use around::Around;
use described::{Checked, Described, Facts, Read};
use draw::{Draw, Here};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// A law's kind.
pub(crate) struct Kind {
    /// Its name.
    pub name: &'static str,
    /// See [`Facts::is_linear`].
    pub is_linear: bool,
    /// See [`Described::READ`].
    pub read: Read<Law>,
    /// See [`Described::DRAWS`].
    pub draws: &'static [Draw],
    /// See [`Described::draw`].
    pub draw: fn(&Here, &mut ChaCha8Rng) -> Option<Law>,
}

/// Reads a law of type `L` as what `wrap` makes of it.
fn read_as<L: Described>(section: &mut Section, wrap: fn(L) -> Law) -> Result<Law, NetworkError> {
    match L::READ {
        Some(read) => read(section).map(wrap),
        None => Err(section.error("kind", format!("no model file has a {}", L::NAME))),
    }
}

macro_rules! register {
    ($($file:ident::$law:ident),* $(,)?) => {
        $(mod $file;)*
        $(pub use $file::$law;)*

        /// A law of force with its parameters.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "physics", content = "parameters", rename_all = "snake_case")]
        pub enum Law { $(#[doc = concat!("See [`", stringify!($law), "`].")] $law($law)),* }

        /// Every kind of law. Effects are drawn in this order.
        pub(crate) const KINDS: &[Kind] = &[$(Kind {
            name: <$law as Described>::NAME,
            is_linear: <$law as Described>::FACTS.is_linear,
            read: if <$law as Described>::READ.is_some() { Some(|section| read_as(section, Law::$law)) } else { None },
            draws: <$law as Described>::DRAWS,
            draw: |here, random| <$law as Described>::draw(here, random).map(Law::$law),
        }),*];

        impl Law {
            /// Its equations, ready to step.
            pub fn to_force(&self) -> Box<dyn ForceLaw> {
                match self { $(Law::$law(law) => law.to_force()),* }
            }

            /// Its name, as model files and truths write it.
            pub fn kind(&self) -> &'static str {
                match self { $(Law::$law(_) => <$law as Described>::NAME),* }
            }

            /// Whether model files have exactly this form. The others are the hidden plant's own.
            pub fn is_in_formats(&self) -> bool {
                match self { $(Law::$law(_) => { const READ: Read<$law> = <$law as Described>::READ; READ.is_some() }),* }
            }

            pub(crate) fn facts(&self) -> Facts {
                match self { $(Law::$law(_) => <$law as Described>::FACTS),* }
            }

            /// Its parameters, and the ranges that its equations accept.
            pub(crate) fn numbers(&self) -> Vec<Checked> {
                match self { $(Law::$law(law) => law.numbers()),* }
            }

            /// The names that verdicts have for it: its own, or for a form of the hidden plant's own the nearest ones.
            pub(crate) fn names(&self, at_ground: bool) -> Vec<&'static str> {
                match self { $(Law::$law(_) => <$law as Described>::names(at_ground)),* }
            }

            /// Answers that are right beside its own names at its own place.
            pub(crate) fn same_as(&self, around: &Around) -> Vec<Answer> {
                match self { $(Law::$law(law) => law.same_as(around)),* }
            }

            /// The keys that [`Law::number_mut`] knows for this law.
            pub fn number_keys(&self) -> &'static [&'static str] {
                match self { $(Law::$law(_) => <$law as Described>::NUMBER_KEYS),* }
            }

            /// The number under a key of a model file, for the kinds whose numbers a nominal model may have wrong.
            pub fn number_mut(&mut self, key: &str) -> Option<&mut f64> {
                if !self.number_keys().contains(&key) {
                    return None;
                }
                match self { $(Law::$law(law) => law.number_mut(key)),* }
            }
        }
    };
}

register!(
    coulomb::Coulomb,
    asymmetric_coulomb::AsymmetricCoulomb,
    stribeck::Stribeck,
    friction_deficit::FrictionDeficit,
    dahl::Dahl,
    lugre::Lugre,
    maxwell_slip::MaxwellSlip,
    damper::Damper,
    asymmetric_damper::AsymmetricDamper,
    quadratic_drag::QuadraticDrag,
    cogging::Cogging,
    bias::Bias,
    cubic_spring::CubicSpring,
    hysteretic_spring::HystereticSpring,
    backlash::Backlash,
    rounded_gap::RoundedGap,
    bristle_field::BristleField,
    warm_friction::WarmFriction,
    load_friction::LoadFriction,
    gear_loss::GearLoss,
    creep::Creep,
    spring::Spring,
    inerter::Inerter,
);

impl Law {
    /// Reads a law of this kind from an element of a model file.
    pub(crate) fn read(section: &mut Section) -> Result<Law, NetworkError> {
        let name = section.need_text("kind")?;
        match KINDS.iter().find(|kind| kind.name == name).and_then(|kind| kind.read) {
            Some(read) => read(section),
            None => {
                let known: Vec<&str> = KINDS.iter().filter(|kind| kind.read.is_some()).map(|kind| kind.name).collect();
                let message = format!("the hidden plant does not know \"{name}\"; it knows {}", known.join(", "));
                Err(section.error("kind", message))
            }
        }
    }

    /// Whether it takes energy out of what moves.
    pub fn takes_energy(&self) -> bool {
        self.facts().takes_energy
    }

    /// Whether it is dry friction, or friction that bends before it slides.
    pub fn is_friction(&self) -> bool {
        self.facts().is_friction
    }

    /// Whether a linear model can imitate it exactly, from wherever it rests.
    pub fn is_linear(&self) -> bool {
        self.facts().is_linear
    }
}
