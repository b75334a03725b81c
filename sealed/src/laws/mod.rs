//! The laws of force between two bodies: those that model files name and those that only a hidden plant has.

mod bristle;
mod bristle_field;
mod damping;
mod friction;
mod gap;
mod hysteresis;
mod load_friction;
mod stiffness;
mod warm_friction;

pub use bristle::{Dahl, Lugre};
pub use bristle_field::{BristleField, LaidField, SpringSliders};
pub use damping::{AsymmetricDamper, Damper, QuadraticDrag};
pub use friction::{AsymmetricCoulomb, Coulomb, FrictionDeficit, Stribeck};
pub use gap::{Backlash, RoundedGap};
pub use hysteresis::HystereticSpring;
pub use load_friction::LoadFriction;
pub use stiffness::{Bias, Cogging, CubicSpring, Inerter, Spring};
pub use warm_friction::WarmFriction;

use serde::{Deserialize, Serialize};

/// One substep of an element's displacement, which laws with a memory follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// m, where the element stood when its memory was last carried on.
    pub from: f64,
    /// m, where it stands now.
    pub to: f64,
    /// m/s, its speed.
    pub speed: f64,
    /// s, the time in between.
    pub duration: f64,
}

/// The three parts of a law that the integrator treats apart: what hangs on the path, what hangs on the speed and
/// is smooth, and dry friction, which is set-valued at rest.
pub trait ForceLaw: Send {
    /// How many numbers the law remembers. All are 0 in a device at rest that was never moved.
    fn memory(&self) -> usize {
        0
    }

    /// N, the part of the force that the path up to now sets. Carries the memory on to the end of the path.
    fn path_force(&self, _path: &Path, _memory: &mut [f64]) -> f64 {
        0.0
    }

    /// N s/m, the damping at displacement `x` (m) and speed `v` (m/s): the smooth force is this times `v`.
    fn damping(&self, _x: f64, _v: f64, _memory: &[f64]) -> f64 {
        0.0
    }

    /// N, the levels of dry friction against motion forwards and backwards at speed `v` (m/s) under the magnitude `load` (N) of
    /// the force of the element named by [`ForceLaw::loaded_by`].
    fn dry(&self, _v: f64, _load: f64, _memory: &[f64]) -> [f64; 2] {
        [0.0, 0.0]
    }

    /// Whether the law has dry friction at all.
    fn is_dry(&self) -> bool {
        false
    }

    /// Carries on what friction itself changes (heat): `friction` (N) acted at speed `v` (m/s) for `duration` (s).
    fn after(&self, _friction: f64, _v: f64, _duration: f64, _memory: &mut [f64]) {}

    /// N/m, a bound of the slope of force over displacement, from which the substep is chosen.
    fn stiffness(&self) -> f64 {
        0.0
    }

    /// kg, the force per relative acceleration.
    fn inertance(&self) -> f64 {
        0.0
    }

    /// Name of the element whose force presses the friction surfaces together.
    fn loaded_by(&self) -> Option<&str> {
        None
    }
}

/// A law of force with its numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "physics", content = "parameters", rename_all = "snake_case")]
pub enum Law {
    /// `k (x - rest)`.
    Spring(Spring),
    /// `b v`.
    Damper(Damper),
    /// `m dv/dt`.
    Inerter(Inerter),
    /// A constant.
    Bias(Bias),
    /// `k x + k3 x^3`.
    CubicSpring(CubicSpring),
    /// `a sin(2 pi x/period + phase)`.
    Cogging(Cogging),
    /// `b± v`.
    AsymmetricDamper(AsymmetricDamper),
    /// `q v abs(v)`.
    QuadraticDrag(QuadraticDrag),
    /// Dry friction of one level.
    Coulomb(Coulomb),
    /// Dry friction of a level for each direction.
    AsymmetricCoulomb(AsymmetricCoulomb),
    /// Dry friction that falls with speed.
    Stribeck(Stribeck),
    /// Dry friction that rises with speed.
    FrictionDeficit(FrictionDeficit),
    /// Dry friction of one bristle that bends.
    Dahl(Dahl),
    /// The same with a level that falls with speed, and damping.
    Lugre(Lugre),
    /// Parallel spring-sliders, each with its own numbers.
    MaxwellSlip(SpringSliders),
    /// A spring that follows one of two lines.
    HystereticSpring(HystereticSpring),
    /// A shaft behind a gap with sharp edges.
    Backlash(Backlash),
    /// Hidden only: a field of bristles.
    BristleField(BristleField),
    /// Hidden only: a shaft behind a gap with rounded edges.
    RoundedGap(RoundedGap),
    /// Hidden only: dry friction that its own heat lowers.
    WarmFriction(WarmFriction),
    /// Hidden only: dry friction under the force of a joint.
    LoadFriction(LoadFriction),
}

impl Law {
    /// Whether it takes energy out of what moves.
    pub fn takes_energy(&self) -> bool {
        let conserves = matches!(self, Law::Spring(_) | Law::Inerter(_) | Law::Bias(_) | Law::CubicSpring(_) | Law::Cogging(_));
        !conserves && !matches!(self, Law::Backlash(_) | Law::RoundedGap(_))
    }

    /// Whether it is dry friction, or friction that bends before it slides.
    pub fn is_friction(&self) -> bool {
        matches!(self, Law::Dahl(_) | Law::Lugre(_) | Law::MaxwellSlip(_) | Law::BristleField(_)) || self.to_force().is_dry()
    }

    /// Its equations, ready to step.
    pub fn to_force(&self) -> Box<dyn ForceLaw> {
        match self {
            Law::Spring(law) => Box::new(law.clone()),
            Law::Damper(law) => Box::new(law.clone()),
            Law::Inerter(law) => Box::new(law.clone()),
            Law::Bias(law) => Box::new(law.clone()),
            Law::CubicSpring(law) => Box::new(law.clone()),
            Law::Cogging(law) => Box::new(law.clone()),
            Law::AsymmetricDamper(law) => Box::new(law.clone()),
            Law::QuadraticDrag(law) => Box::new(law.clone()),
            Law::Coulomb(law) => Box::new(law.clone()),
            Law::AsymmetricCoulomb(law) => Box::new(law.clone()),
            Law::Stribeck(law) => Box::new(law.clone()),
            Law::FrictionDeficit(law) => Box::new(law.clone()),
            Law::Dahl(law) => Box::new(law.clone()),
            Law::Lugre(law) => Box::new(law.clone()),
            Law::MaxwellSlip(law) => Box::new(law.clone()),
            Law::HystereticSpring(law) => Box::new(law.clone()),
            Law::Backlash(law) => Box::new(law.clone()),
            Law::BristleField(law) => Box::new(law.laid_out()),
            Law::RoundedGap(law) => Box::new(law.clone()),
            Law::WarmFriction(law) => Box::new(law.clone()),
            Law::LoadFriction(law) => Box::new(law.clone()),
        }
    }

    /// Its name, as model files and truths write it.
    pub fn kind(&self) -> &'static str {
        match self {
            Law::Spring(_) => "spring",
            Law::Damper(_) => "damper",
            Law::Inerter(_) => "inerter",
            Law::Bias(_) => "bias",
            Law::CubicSpring(_) => "cubic_spring",
            Law::Cogging(_) => "cogging",
            Law::AsymmetricDamper(_) => "asymmetric_damper",
            Law::QuadraticDrag(_) => "quadratic_drag",
            Law::Coulomb(_) => "coulomb",
            Law::AsymmetricCoulomb(_) => "asymmetric_coulomb",
            Law::Stribeck(_) => "stribeck",
            Law::FrictionDeficit(_) => "friction_deficit",
            Law::Dahl(_) => "dahl",
            Law::Lugre(_) => "lugre",
            Law::MaxwellSlip(_) => "maxwell_slip",
            Law::HystereticSpring(_) => "hysteretic_spring",
            Law::Backlash(_) => "backlash",
            Law::BristleField(_) => "bristle_field",
            Law::RoundedGap(_) => "rounded_gap",
            Law::WarmFriction(_) => "warm_friction",
            Law::LoadFriction(_) => "load_friction",
        }
    }

    /// The number under a key of a model file, for the kinds whose numbers a nominal model may have wrong: `stiffness` of a
    /// spring, `damping`, `inertance`, `force` of Coulomb friction, and both slopes of a hysteretic spring under `stiffness`'s two keys.
    pub fn number_mut(&mut self, key: &str) -> Option<&mut f64> {
        match (self, key) {
            (Law::Spring(law), "stiffness") => Some(&mut law.stiffness),
            (Law::CubicSpring(law), "stiffness") => Some(&mut law.stiffness),
            (Law::Damper(law), "damping") => Some(&mut law.damping),
            (Law::Inerter(law), "inertance") => Some(&mut law.inertance),
            (Law::Coulomb(law), "force") => Some(&mut law.force),
            (Law::HystereticSpring(law), "stiffness_positive") => Some(&mut law.stiffness_positive),
            (Law::HystereticSpring(law), "stiffness_negative") => Some(&mut law.stiffness_negative),
            _ => None,
        }
    }

    /// The keys that [`Law::number_mut`] knows for this law.
    pub fn number_keys(&self) -> &'static [&'static str] {
        match self {
            Law::Spring(_) | Law::CubicSpring(_) => &["stiffness"],
            Law::Damper(_) => &["damping"],
            Law::Inerter(_) => &["inertance"],
            Law::Coulomb(_) => &["force"],
            Law::HystereticSpring(_) => &["stiffness_positive", "stiffness_negative"],
            _ => &[],
        }
    }
}
