//! Element kinds: one file each, and one line of registration here.
//!
//! A kind says three things: what its parameters are ([`Kind`]), what they are in one element (its
//! struct, gathered in [`Law`]), and how it moves ([`Mechanics`]).

mod asymmetric_coulomb;
mod asymmetric_damper;
mod backlash;
mod bias;
mod bouc_wen;
mod cogging;
mod contact;
mod coulomb;
mod cubic_spring;
mod dahl;
mod damper;
mod decay;
mod friction_deficit;
mod hunt_crossley;
mod hysteretic_spring;
mod inerter;
mod levels;
mod lugre;
mod maxwell_slip;
mod preisach_lugre;
mod quadratic_drag;
mod spring;
mod stribeck;

pub use asymmetric_coulomb::AsymmetricCoulomb;
pub use asymmetric_damper::AsymmetricDamper;
pub use backlash::Backlash;
pub use bias::Bias;
pub use bouc_wen::BoucWen;
pub use cogging::Cogging;
pub use contact::Contact;
pub use coulomb::Coulomb;
pub use cubic_spring::CubicSpring;
pub use dahl::Dahl;
pub use damper::Damper;
pub use friction_deficit::FrictionDeficit;
pub use hunt_crossley::HuntCrossley;
pub use hysteretic_spring::HystereticSpring;
pub use inerter::Inerter;
pub use levels::FrictionLevels;
pub use lugre::Lugre;
pub use maxwell_slip::MaxwellSlip;
pub use preisach_lugre::PreisachLugre;
pub use quadratic_drag::QuadraticDrag;
pub use spring::Spring;
pub use stribeck::Stribeck;

/// What a parameter may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// Any finite number.
    Any,
    /// At least 0.
    NonNegative,
    /// Above 0.
    Positive,
    /// From the first to the second, both allowed.
    Between(f64, f64),
}

/// A parameter of an element kind.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Key in the model file.
    pub key: &'static str,
    /// Unit for a translation, such as `N/m`.
    pub unit: &'static str,
    /// What it may be.
    pub range: Range,
    /// Its value where the file has none; `None` when the file must have it. Of a list that a file may leave out any number: it is then empty.
    pub default: Option<f64>,
    /// Whether it is a list of numbers.
    pub list: bool,
    /// One line.
    pub doc: &'static str,
}

impl Parameter {
    /// A number that the file must have.
    const fn number(key: &'static str, unit: &'static str, range: Range, doc: &'static str) -> Parameter {
        Parameter { key, unit, range, default: None, list: false, doc }
    }

    /// A list of numbers that the file must have.
    const fn numbers(key: &'static str, unit: &'static str, range: Range, doc: &'static str) -> Parameter {
        Parameter { key, unit, range, default: None, list: true, doc }
    }

    /// The same, with a value for files that have none.
    const fn or(self, default: f64) -> Parameter {
        Parameter { key: self.key, unit: self.unit, range: self.range, default: Some(default), list: self.list, doc: self.doc }
    }
}

impl Parameter {
    /// Its values where a file has none, as [`Kind::build`] takes them; `None` when the file must have them.
    pub fn default_values(&self) -> Option<Vec<f64>> {
        self.default.map(|value| if self.list { Vec::new() } else { vec![value] })
    }
}

/// What the registry knows of an element kind.
#[derive(Debug)]
pub struct Kind {
    /// Name in model files.
    pub name: &'static str,
    /// Equation in one line.
    pub equation: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    /// What energy it may create, and when.
    pub energy: &'static str,
    /// Its parameters, in the order of the file format.
    pub parameters: &'static [Parameter],
    /// Builds the law from values in the order of `parameters` (a number is a list of one), each
    /// within its range. Errors say in one sentence which relation between parameters is broken.
    pub build: fn(&[Vec<f64>]) -> Result<Law, String>,
}

/// How a stepper has to treat an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
    /// `f = stiffness x + damping v + inertance dv/dt + force`: part of the constant matrices.
    Linear(Linear),
    /// Set-valued at rest: a bounded multiplier on the relative velocity.
    Friction(FrictionLevels),
    /// A force that depends on `x`, `v` and a memory of the path: [`Mechanics::advance`] and [`Mechanics::force`].
    Path,
}

/// Coefficients of a linear element.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Linear {
    /// N/m.
    pub stiffness: f64,
    /// N s/m.
    pub damping: f64,
    /// kg.
    pub inertance: f64,
    /// Force at `x = v = dv/dt = 0`, N.
    pub force: f64,
}

/// Largest slopes that an element shows, for the choice of step and of the solution method.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Slopes {
    /// Of force over displacement, N/m.
    pub stiffness: f64,
    /// Of force over velocity, N s/m.
    pub damping: f64,
    /// Whether these are bounds; else they are estimates for ordinary deflections and speeds.
    pub bounded: bool,
}

/// How an element moves. `x` in m and `v` in m/s are taken across it; forces in N, positive when it is stretched.
///
/// The memory holds what the element remembers of its path; at rest all of it is zero.
pub trait Mechanics {
    /// How a stepper has to treat it.
    fn role(&self) -> Role {
        Role::Path
    }

    /// Length of its memory, numbers.
    fn memory_len(&self) -> usize {
        0
    }

    /// Largest slopes of its force. Only asked of a [`Role::Path`].
    fn slopes(&self) -> Slopes {
        Slopes::default()
    }

    /// Advances the memory along the straight path from `from` to `to`, which takes `dt` seconds.
    fn advance(&self, _memory: &mut [f64], _from: f64, _to: f64, _dt: f64) {}

    /// Force at `x` and `v` with the memory as it is.
    fn force(&self, _memory: &[f64], _x: f64, _v: f64) -> f64 {
        0.0
    }

    /// Mean force over the straight path from `from` to `to` at speed `v`, with the memory of its middle. Worth its own
    /// form where the force jumps on the way.
    fn mean_force(&self, memory: &[f64], from: f64, to: f64, v: f64) -> f64 {
        self.force(memory, 0.5 * (from + to), v)
    }

    /// Energy that can be had back, J.
    fn stored(&self, _memory: &[f64], _x: f64) -> f64 {
        0.0
    }
}

macro_rules! register {
    ($($law:ident),* $(,)?) => {
        /// Kind and parameters of an element.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Law { $(#[doc = concat!("See [`", stringify!($law), "`].")] $law($law)),* }

        /// Every element kind.
        pub const KINDS: &[&Kind] = &[$(&$law::KIND),*];

        impl Law {
            /// The kind's description.
            pub fn kind(&self) -> &'static Kind {
                match self { $(Law::$law(_) => &$law::KIND),* }
            }

            /// Parameter values in the order of [`Kind::parameters`].
            pub fn values(&self) -> Vec<Vec<f64>> {
                match self { $(Law::$law(law) => law.values()),* }
            }
        }

        impl Mechanics for Law {
            fn role(&self) -> Role {
                match self { $(Law::$law(law) => law.role()),* }
            }
            fn memory_len(&self) -> usize {
                match self { $(Law::$law(law) => law.memory_len()),* }
            }
            fn slopes(&self) -> Slopes {
                match self { $(Law::$law(law) => law.slopes()),* }
            }
            #[inline]
            fn advance(&self, memory: &mut [f64], from: f64, to: f64, dt: f64) {
                match self { $(Law::$law(law) => law.advance(memory, from, to, dt)),* }
            }
            #[inline]
            fn force(&self, memory: &[f64], x: f64, v: f64) -> f64 {
                match self { $(Law::$law(law) => law.force(memory, x, v)),* }
            }
            #[inline]
            fn mean_force(&self, memory: &[f64], from: f64, to: f64, v: f64) -> f64 {
                match self { $(Law::$law(law) => law.mean_force(memory, from, to, v)),* }
            }
            fn stored(&self, memory: &[f64], x: f64) -> f64 {
                match self { $(Law::$law(law) => law.stored(memory, x)),* }
            }
        }
    };
}

register!(
    Spring,
    Damper,
    Inerter,
    Coulomb,
    AsymmetricCoulomb,
    Stribeck,
    AsymmetricDamper,
    FrictionDeficit,
    QuadraticDrag,
    Dahl,
    Lugre,
    MaxwellSlip,
    PreisachLugre,
    HystereticSpring,
    BoucWen,
    Backlash,
    Contact,
    HuntCrossley,
    CubicSpring,
    Cogging,
    Bias,
);

/// The kind with this name in model files.
pub fn kind_named(name: &str) -> Option<&'static Kind> {
    KINDS.iter().copied().find(|kind| kind.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_values_round_trip() {
        for (i, kind) in KINDS.iter().enumerate() {
            assert!(KINDS[..i].iter().all(|other| other.name != kind.name), "{}", kind.name);
            let one = |p: &Parameter| match (p.list, p.default) {
                (true, Some(_)) => vec![],
                (true, None) => vec![1.0, 1.0],
                (false, _) => vec![1.0],
            };
            let values: Vec<Vec<f64>> = kind.parameters.iter().map(one).collect();
            if let Ok(law) = (kind.build)(&values) {
                assert_eq!(law.values(), values, "{}", kind.name);
                assert_eq!(law.kind().name, kind.name);
            }
        }
    }

    #[test]
    fn defaults_lie_in_their_ranges() {
        for kind in KINDS {
            for p in kind.parameters {
                let Some(d) = p.default else { continue };
                let inside = match p.range {
                    Range::Any => d.is_finite(),
                    Range::NonNegative => d >= 0.0,
                    Range::Positive => d > 0.0,
                    Range::Between(low, high) => (low..=high).contains(&d),
                };
                assert!(inside, "{} {}", kind.name, p.key);
            }
        }
    }

    #[test]
    fn at_rest_only_a_bias_or_a_phase_pushes() {
        for kind in KINDS {
            let values: Vec<Vec<f64>> = kind.parameters.iter().map(|p| p.default_values().unwrap_or(vec![1.0])).collect();
            let Ok(law) = (kind.build)(&values) else { continue };
            if law.role() == Role::Path && kind.name != "cogging" && kind.name != "bias" {
                assert_eq!(law.force(&vec![0.0; law.memory_len()], 0.0, 0.0), 0.0, "{}", kind.name);
            }
        }
    }
}
