//! Element kinds: one file each, and one line of registration here.
//!
//! A kind's file defines its parameters ([`KindOf`]), their values in one element (its struct, gathered in [`Law`]), and how it acts. It is a
//! [`LinearLaw`], a [`FrictionLaw`] (dry, set-valued at rest) or a [`PathLaw`] (any other force).
//!
//! The modules are declared by the registration, where `cargo fmt` does not see them: format a kind's file with
//! `rustfmt --edition 2024 --config-path . plant/src/elements/KIND.rs`.

mod decay;
mod gaussian;
mod harmonic;
mod kind;
mod law;
mod sine;

pub use kind::{KindOf, Parameter, Range};
pub use law::{Bristles, FrictionLaw, Linear, LinearLaw, PathLaw, Rubbing, Side, Slopes};
pub use sine::{DryFriction, Sine};

/// An element kind.
pub type Kind = KindOf<Law>;

/// How a stepper has to treat an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
    /// `f = stiffness x + damping v + inertance dv/dt + force`: part of the constant matrices.
    Linear(Linear),
    /// Set-valued at rest: a bounded multiplier on the relative velocity, whose bounds are [`Law::level`].
    Friction,
    /// A force that depends on `x`, `v` and a memory of the path: [`Law::advance`] and [`Law::force`].
    Path,
}

/// The second expression where a kind's role is the first word, else the third.
macro_rules! where_it_is {
    (linear, linear, $then:expr, $otherwise:expr) => {
        $then
    };
    (friction, friction, $then:expr, $otherwise:expr) => {
        $then
    };
    (path, path, $then:expr, $otherwise:expr) => {
        $then
    };
    ($asked:ident, $is:ident, $then:expr, $otherwise:expr) => {
        $otherwise
    };
}

macro_rules! register {
    ($($role:ident $file:ident::$law:ident),* $(,)?) => {
        $(mod $file;)*
        $(pub use $file::$law;)*

        /// Kind and parameters of an element.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Law { $(#[doc = concat!("See [`", stringify!($law), "`].")] $law($law)),* }

        /// Every element kind.
        pub const KINDS: &[&Kind] = &[$(&$law::KIND.built_by(|values| ($law::KIND.build)(values).map(Law::$law))),*];

        impl Law {
            /// The kind's description.
            pub fn kind(&self) -> &'static Kind {
                match self { $(Law::$law(_) => const { &$law::KIND.built_by(|values| ($law::KIND.build)(values).map(Law::$law)) }),* }
            }

            /// Parameter values in the order of [`KindOf::parameters`].
            pub fn values(&self) -> Vec<Vec<f64>> {
                match self { $(Law::$law(law) => law.values()),* }
            }

            /// How a stepper has to treat it.
            pub fn role(&self) -> Role {
                match self {
                    $(Law::$law(_law) => where_it_is!(linear, $role, Role::Linear(_law.coefficients()),
                        where_it_is!(friction, $role, Role::Friction, Role::Path))),*
                }
            }

            /// What it looks like to a sine: for a linear element its own coefficients, at any amplitude.
            pub fn linearised(&self, at: &Sine) -> Linear {
                match self {
                    $(Law::$law(law) => where_it_is!(linear, $role, { let _ = at; Linear { force: 0.0, ..law.coefficients() } }, law.linearised(at))),*
                }
            }

            /// Length of its memory, numbers.
            pub fn memory_len(&self) -> usize {
                match self { $(Law::$law(_law) => where_it_is!(linear, $role, 0, _law.memory_len())),* }
            }

            /// Level of dry friction, N; 0 of other laws.
            #[inline]
            pub fn level(&self, at: &Rubbing) -> f64 {
                match self { $(Law::$law(_law) => where_it_is!(friction, $role, _law.level(at), 0.0)),* }
            }

            /// Whether the levels of dry friction are always the same.
            pub(crate) fn is_constant(&self) -> bool {
                match self { $(Law::$law(_law) => where_it_is!(friction, $role, _law.is_constant(), false)),* }
            }

            /// Carries dry friction's memory on over `dt` seconds in which it took `work`, J.
            pub fn rubbed(&self, memory: &mut [f64], work: f64, dt: f64) {
                match self { $(Law::$law(_law) => where_it_is!(friction, $role, _law.rubbed(memory, work, dt), {})),* }
            }

            /// Largest slopes of the force of a [`Role::Path`]; 0 of dry friction.
            pub fn slopes(&self) -> Slopes {
                match self {
                    $(Law::$law(_law) => where_it_is!(path, $role, _law.slopes(),
                        where_it_is!(linear, $role, _law.coefficients().slopes(), Slopes::default()))),*
                }
            }

            /// Advances the memory of a [`Role::Path`] along the straight path from `from` to `to`, m, which takes `dt` seconds.
            #[inline]
            pub fn advance(&self, memory: &mut [f64], from: f64, to: f64, dt: f64) {
                match self { $(Law::$law(_law) => where_it_is!(path, $role, _law.advance(memory, from, to, dt), {})),* }
            }

            /// Force of a [`Role::Path`], or of a linear law without inertance, at `x`, m, and `v`, m/s, with the present memory, N; 0 for dry friction.
            #[inline]
            pub fn force(&self, memory: &[f64], x: f64, v: f64) -> f64 {
                match self {
                    $(Law::$law(_law) => where_it_is!(path, $role, _law.force(memory, x, v),
                        where_it_is!(linear, $role, _law.coefficients().at(x, v), 0.0))),*
                }
            }

            /// See [`PathLaw::mean_force`]; of other laws as [`Law::force`].
            #[inline]
            pub fn mean_force(&self, memory: &[f64], from: f64, to: f64, v: f64) -> f64 {
                match self {
                    $(Law::$law(_law) => where_it_is!(path, $role, _law.mean_force(memory, from, to, v),
                        where_it_is!(linear, $role, _law.coefficients().at(0.5 * (from + to), v), 0.0))),*
                }
            }

            /// Energy in a [`Role::Path`] or a linear law that can be had back, J.
            pub fn stored(&self, memory: &[f64], x: f64) -> f64 {
                match self {
                    $(Law::$law(_law) => where_it_is!(path, $role, _law.stored(memory, x),
                        where_it_is!(linear, $role, _law.coefficients().stored(x), 0.0))),*
                }
            }

            /// One sentence where a [`Role::Path`] creates energy in cycles of this amplitude (in `unit`).
            pub fn creates_energy(&self, amplitude: f64, unit: &str) -> Option<String> {
                match self { $(Law::$law(_law) => where_it_is!(path, $role, _law.creates_energy(amplitude, unit), None)),* }
            }

            /// Whether an evaluation of a [`Role::Path`] takes far longer than the rest of a substep.
            pub fn is_costly(&self) -> bool {
                match self { $(Law::$law(_law) => where_it_is!(path, $role, _law.is_costly(), false)),* }
            }

            /// Whether a [`Role::Path`] answers in proportion, by frequency alone.
            pub fn is_viscoelastic(&self) -> bool {
                match self { $(Law::$law(_law) => where_it_is!(path, $role, _law.is_viscoelastic(), false)),* }
            }

            /// The bristles of a [`Role::Path`] at speed `v`, m/s; `None` for a law without.
            pub fn bristles(&self, memory: &[f64], v: f64) -> Option<Bristles> {
                match self { $(Law::$law(_law) => where_it_is!(path, $role, _law.bristles(memory, v), None)),* }
            }
        }
    };
}

register!(
    linear spring::Spring,
    linear damper::Damper,
    linear inerter::Inerter,
    friction coulomb::Coulomb,
    friction asymmetric_coulomb::AsymmetricCoulomb,
    friction stribeck::Stribeck,
    path asymmetric_damper::AsymmetricDamper,
    friction friction_deficit::FrictionDeficit,
    path quadratic_drag::QuadraticDrag,
    path dahl::Dahl,
    path lugre::Lugre,
    path maxwell_slip::MaxwellSlip,
    path preisach_lugre::PreisachLugre,
    path hysteretic_spring::HystereticSpring,
    path bouc_wen::BoucWen,
    path backlash::Backlash,
    path contact::Contact,
    path hunt_crossley::HuntCrossley,
    path cubic_spring::CubicSpring,
    path cogging::Cogging,
    linear bias::Bias,
    friction load_friction::LoadFriction,
    friction warm_friction::WarmFriction,
    friction gear_loss::GearLoss,
    path creep::Creep,
);

impl Law {
    /// Level of dry friction without load and with the memory of rest, N; 0 of other laws. `speed` is `None` while it sticks.
    pub fn unloaded_level(&self, side: Side, speed: Option<f64>) -> f64 {
        self.level(&Rubbing { side, speed, load: 0.0, memory: &vec![0.0; self.memory_len()] })
    }

    /// The same with every force `factor` times as large at every motion; unchanged where the kind refuses such parameters.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Law {
        let kind = self.kind();
        let mut values = self.values();
        for (parameter, values) in kind.parameters.iter().zip(&mut values) {
            parameter.scale_force(values, factor);
        }
        (kind.build)(&values).unwrap_or_else(|_| self.clone())
    }
}

/// The kind with this name in model files.
pub fn kind_named(name: &str) -> Option<&'static Kind> {
    KINDS.iter().copied().find(|kind| kind.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One law of every kind that builds with its defaults and ones for the rest.
    fn laws() -> Vec<Law> {
        let ones = |p: &Parameter| p.default_values().unwrap_or(vec![1.0; if p.list { 2 } else { 1 }]);
        KINDS.iter().filter_map(|kind| (kind.build)(&kind.parameters.iter().map(ones).collect::<Vec<_>>()).ok()).collect()
    }

    #[test]
    fn names_are_unique_and_values_round_trip() {
        for (i, kind) in KINDS.iter().enumerate() {
            assert!(KINDS[..i].iter().all(|other| other.name != kind.name), "{}", kind.name);
        }
        for law in laws() {
            let again = (law.kind().build)(&law.values()).unwrap();
            assert_eq!(again, law);
            assert_eq!(again.kind().name, law.kind().name);
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
        for law in laws() {
            let name = law.kind().name;
            if law.role() == Role::Path && name != "cogging" && name != "bias" {
                assert_eq!(law.force(&vec![0.0; law.memory_len()], 0.0, 0.0), 0.0, "{name}");
            }
        }
    }

    #[test]
    fn a_scaled_law_pushes_as_much_more() {
        for law in laws().iter().filter(|law| law.role() == Role::Path) {
            let more = law.scaled(1.5);
            let mut memory = vec![0.0; law.memory_len()];
            let mut memory_of_more = memory.clone();
            let mut x = 0.0;
            for i in 1..200 {
                let next = 1.7 * (0.1 * f64::from(i)).sin();
                law.advance(&mut memory, x, next, 1e-3);
                more.advance(&mut memory_of_more, x, next, 1e-3);
                let v = (next - x) / 1e-3;
                x = next;
                let (force, larger) = (law.force(&memory, x, v), more.force(&memory_of_more, x, v));
                assert!((larger - 1.5 * force).abs() <= 1e-9 * force.abs(), "{}: {force} {larger}", law.kind().name);
            }
        }
    }
}
