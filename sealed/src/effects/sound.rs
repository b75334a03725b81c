//! Which numbers the equations of an effect take.

use super::Physics;
use crate::laws::Law;

/// More bristles than this only cost time.
const BRISTLES_AT_MOST: usize = 1024;

/// A number's key, its value, and what it must be.
type Checked = (&'static str, f64, Allowed);

#[derive(Clone, Copy)]
enum Allowed {
    Any,
    NotNegative,
    Positive,
    /// At least 1.
    One,
}

use Allowed::{Any, NotNegative, One, Positive};

impl Allowed {
    fn holds(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Any => true,
                NotNegative => value >= 0.0,
                Positive => value > 0.0,
                One => value >= 1.0,
            }
    }

    fn words(self) -> &'static str {
        match self {
            Any => "a finite number",
            NotNegative => "a finite number of at least 0",
            Positive => "a finite number above 0",
            One => "a finite number of at least 1",
        }
    }
}

/// The key, the value and what it must be, of the first number that the equations do not take.
pub(super) fn unsound(physics: &Physics) -> Option<(&'static str, f64, &'static str)> {
    let numbers = match physics {
        Physics::Law(law) => of_law(law),
        Physics::Inertia { inertia } => vec![("inertia", *inertia, Positive)],
        Physics::SeriesCompliance { stiffness, damping, inertia } => {
            vec![("stiffness", *stiffness, Positive), ("damping", *damping, NotNegative), ("inertia", *inertia, Positive)]
        }
        Physics::Delay { delay } => vec![("delay", *delay, NotNegative)],
        Physics::Bandwidth { bandwidth } => vec![("bandwidth", *bandwidth, Positive)],
        Physics::BackEmf { back_emf } => vec![("back_emf", *back_emf, NotNegative)],
        Physics::Saturation { saturation } => vec![("saturation", *saturation, Positive)],
    };
    let wrong = numbers.into_iter().find(|(_, value, allowed)| !allowed.holds(*value));
    wrong.map(|(key, value, allowed)| (key, value, allowed.words()))
}

fn of_law(law: &Law) -> Vec<Checked> {
    match law {
        Law::Spring(l) => vec![("stiffness", l.stiffness, NotNegative), ("rest", l.rest, Any)],
        Law::Damper(l) => vec![("damping", l.damping, NotNegative)],
        Law::Inerter(l) => vec![("inertance", l.inertance, NotNegative)],
        Law::Bias(l) => vec![("force", l.force, Any)],
        Law::CubicSpring(l) => vec![("stiffness", l.stiffness, NotNegative), ("cubic", l.cubic, Any)],
        Law::Cogging(l) => vec![("amplitude", l.amplitude, Any), ("period", l.period, Positive), ("phase", l.phase, Any)],
        Law::AsymmetricDamper(l) => vec![("positive", l.positive, NotNegative), ("negative", l.negative, NotNegative)],
        Law::QuadraticDrag(l) => vec![("coefficient", l.coefficient, NotNegative)],
        Law::Coulomb(l) => vec![("force", l.force, NotNegative)],
        Law::AsymmetricCoulomb(l) => vec![("positive", l.positive, NotNegative), ("negative", l.negative, NotNegative)],
        Law::Stribeck(l) => {
            vec![("coulomb", l.coulomb, NotNegative), ("static", l.at_rest, NotNegative), ("velocity", l.velocity, Positive)]
        }
        Law::FrictionDeficit(l) => {
            vec![("coulomb", l.coulomb, NotNegative), ("rest", l.rest, NotNegative), ("velocity", l.velocity, Positive)]
        }
        Law::Dahl(l) => vec![("stiffness", l.stiffness, Positive), ("coulomb", l.coulomb, Positive)],
        Law::Lugre(l) => vec![
            ("stiffness", l.stiffness, Positive),
            ("damping", l.damping, NotNegative),
            ("coulomb", l.coulomb, Positive),
            ("static", l.at_rest / l.coulomb, One),
            ("velocity", l.velocity, Positive),
        ],
        Law::MaxwellSlip(l) => {
            let lists = l.stiffness.iter().map(|v| ("stiffness", *v, Positive)).chain(l.force.iter().map(|v| ("force", *v, Positive)));
            let same = if l.stiffness.len() == l.force.len() { 1.0 } else { 0.0 };
            std::iter::once(("length of force over that of stiffness", same, One)).chain(lists).collect()
        }
        Law::HystereticSpring(l) => vec![
            ("stiffness_positive", l.stiffness_positive, NotNegative),
            ("stiffness_negative", l.stiffness_negative, NotNegative),
            ("offset_positive", l.offset_positive, Any),
            ("offset_negative", l.offset_negative, Any),
            ("bandwidth", l.bandwidth, Positive),
        ],
        Law::Backlash(l) => vec![("gap", l.gap, NotNegative), ("stiffness", l.stiffness, Positive), ("damping", l.damping, NotNegative)],
        Law::BristleField(l) => vec![
            ("stiffness", l.stiffness, Positive),
            ("force", l.force, Positive),
            ("stiffness_spread", l.stiffness_spread, NotNegative),
            ("force_spread", l.force_spread, NotNegative),
            ("static_ratio", l.static_ratio, One),
            ("velocity", l.velocity, Positive),
            ("count", if l.count <= BRISTLES_AT_MOST { l.count as f64 } else { f64::INFINITY }, One),
        ],
        Law::RoundedGap(l) => vec![
            ("gap", l.gap, NotNegative),
            ("rounding", l.rounding, Positive),
            ("stiffness", l.stiffness, Positive),
            ("damping", l.damping, NotNegative),
        ],
        Law::WarmFriction(l) => vec![
            ("force", l.force, NotNegative),
            ("half_warming", l.half_warming, Positive),
            ("heat_capacity", l.heat_capacity, Positive),
            ("cooling_time", l.cooling_time, Positive),
        ],
        Law::LoadFriction(l) => vec![("force", l.force, NotNegative), ("coefficient", l.coefficient, NotNegative)],
    }
}
