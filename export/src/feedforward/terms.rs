//! What a controller can take off a joint: forces that depend on where the joint is, how fast it moves and how it is loaded.

use crate::left_out::LeftOut;
use backdrive_plant::elements::{Coulomb, Law, Role, Stribeck};
use backdrive_plant::model::{Model, Motion};
use backdrive_plant::robot::JointKind;

/// Width of the smooth sign, m/s or rad/s, by default; see [`width_for`].
const WIDTH: [f64; 2] = [1e-3, 1e-2];
/// The smooth sign is at most this share of the speed within which friction falls or rises.
const SHARE_OF_STRIBECK: f64 = 0.2;

/// A force on the effort's side: what a motor adds so that the element is not felt. `q`, `dq` and `load` are the joint's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Term {
    /// `positive s` for dq > 0, `negative s` else, s the smooth sign; N or N m.
    Coulomb {
        /// Forwards.
        positive: f64,
        /// Backwards.
        negative: f64,
    },
    /// `(coulomb + (rest - coulomb) exp(-(dq/velocity)²)) s`.
    Stribeck {
        /// At speed, N or N m.
        coulomb: f64,
        /// At rest, N or N m.
        rest: f64,
        /// m/s or rad/s.
        velocity: f64,
    },
    /// `driving |load| s` where the joint moves against its load, `driven |load| s` where the load moves it.
    Load {
        /// Friction per load.
        driving: f64,
        /// Friction per load.
        driven: f64,
    },
    /// `positive dq` for dq > 0, `negative dq` else; N s/m or N m s/rad.
    Viscous {
        /// Forwards.
        positive: f64,
        /// Backwards.
        negative: f64,
    },
    /// `coefficient dq |dq|`, N s²/m² or N m s²/rad².
    Drag {
        /// N s²/m² or N m s²/rad².
        coefficient: f64,
    },
    /// `stiffness (q - rest) + cubic q³`.
    Spring {
        /// N/m or N m/rad.
        stiffness: f64,
        /// m or rad.
        rest: f64,
        /// N/m³ or N m/rad³.
        cubic: f64,
    },
    /// `amplitude sin(2π q/period + phase)`.
    Cogging {
        /// N or N m.
        amplitude: f64,
        /// m or rad.
        period: f64,
        /// rad.
        phase: f64,
    },
    /// The same everywhere, such as a weight, N or N m.
    Constant {
        /// N or N m.
        force: f64,
    },
}

/// A joint and what can be taken off it.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name of the body, or of the robot's joint.
    pub name: String,
    /// Of its effort: `N` or `N m`.
    pub unit: &'static str,
    /// Of its position: `m` or `rad`.
    pub position_unit: &'static str,
    /// Width w of the smooth sign tanh(dq/w), m/s or rad/s.
    pub width: f64,
    /// Terms, each with the name and the kind of its element.
    pub terms: Vec<(String, &'static str, Term)>,
}

/// The joints of a model and what is left out; `width` is the smooth sign's, where it is to be another.
pub(super) fn joints(model: &Model, width: Option<f64>) -> (Vec<Joint>, Vec<LeftOut>) {
    let mut left_out = Vec::new();
    let mut terms: Vec<Vec<(String, &'static str, Term)>> = vec![Vec::new(); model.bodies.len()];
    for (index, element) in model.elements.iter().enumerate() {
        let (body, sign) = match element.between {
            [Some(body), None] => (body, 1.0),
            [None, Some(body)] => (body, -1.0),
            [None, None] => continue,
            [Some(_), Some(_)] => {
                // What is linear between two bodies is the device's structure, and no loss to be made good.
                if !matches!(element.law.role(), Role::Linear(_)) {
                    let why = "it acts between two bodies, and a function of one joint does not know where the other is";
                    left_out.push(LeftOut::element(model, index, why, None));
                }
                continue;
            }
        };
        let found = exactly(&element.law, sign).unwrap_or_else(|| {
            let (why, instead) = nearest(&element.law);
            let found = instead.as_ref().and_then(|(law, _)| exactly(law, sign)).unwrap_or_default();
            left_out.push(LeftOut::element(model, index, why, instead));
            found
        });
        let named = found.into_iter().map(|term| (element.name.clone(), element.law.kind().name, term));
        if let Some(terms) = terms.get_mut(body) {
            terms.extend(named);
        }
    }
    let joints = terms.into_iter().enumerate().filter(|(_, terms)| !terms.is_empty());
    let joint = |(body, terms): (usize, Vec<_>)| {
        let turns = turns(model, body);
        Joint {
            name: model.bodies[body].name.clone(),
            unit: if turns { "N m" } else { "N" },
            position_unit: if turns { "rad" } else { "m" },
            width: width.unwrap_or_else(|| width_for(&terms, turns)),
            terms,
        }
    };
    (joints.map(joint).collect(), left_out)
}

/// Whether a body turns.
fn turns(model: &Model, body: usize) -> bool {
    let coordinate = model.arm.as_ref().and_then(|arm| {
        let index = arm.bodies.iter().position(|b| *b == body)?;
        arm.tree.coordinates().get(index)
    });
    coordinate.map_or(model.motion == Motion::Rotation, |c| c.kind == JointKind::Revolute)
}

/// Narrow against the speeds within which friction changes.
fn width_for(terms: &[(String, &'static str, Term)], turns: bool) -> f64 {
    let speeds = terms.iter().filter_map(|(_, _, term)| match term {
        Term::Stribeck { velocity, .. } => Some(SHARE_OF_STRIBECK * velocity),
        _ => None,
    });
    speeds.fold(WIDTH[usize::from(turns)], f64::min)
}

/// A law as terms, exactly but for the smooth sign. `sign` is -1 where the body is the element's second end: its displacement is then that of the element
/// turned round.
fn exactly(law: &Law, sign: f64) -> Option<Vec<Term>> {
    let both = |positive: f64, negative: f64| if sign > 0.0 { (positive, negative) } else { (negative, positive) };
    Some(match law {
        Law::Coulomb(l) => vec![Term::Coulomb { positive: l.force, negative: l.force }],
        Law::AsymmetricCoulomb(l) => {
            let (positive, negative) = both(l.positive, l.negative);
            vec![Term::Coulomb { positive, negative }]
        }
        Law::Stribeck(l) => vec![Term::Stribeck { coulomb: l.coulomb, rest: l.at_rest, velocity: l.velocity }],
        Law::FrictionDeficit(l) => vec![Term::Stribeck { coulomb: l.coulomb, rest: l.rest, velocity: l.velocity }],
        Law::LoadFriction(l) => {
            let load = Term::Load { driving: l.coefficient, driven: l.coefficient };
            vec![Term::Coulomb { positive: l.force, negative: l.force }, load]
        }
        Law::GearLoss(l) => vec![Term::Load { driving: 1.0 / l.efficiency - 1.0, driven: 1.0 - l.back_efficiency }],
        Law::Damper(l) => vec![Term::Viscous { positive: l.damping, negative: l.damping }],
        Law::AsymmetricDamper(l) => {
            let (positive, negative) = both(l.positive, l.negative);
            vec![Term::Viscous { positive, negative }]
        }
        Law::QuadraticDrag(l) => vec![Term::Drag { coefficient: l.coefficient }],
        Law::Spring(l) => vec![Term::Spring { stiffness: l.stiffness, rest: sign * l.rest, cubic: 0.0 }],
        Law::CubicSpring(l) => vec![Term::Spring { stiffness: l.stiffness, rest: 0.0, cubic: l.cubic }],
        Law::Cogging(l) => vec![Term::Cogging { amplitude: l.amplitude, period: l.period, phase: sign * l.phase }],
        Law::Bias(l) => vec![Term::Constant { force: sign * l.force }],
        _ => return None,
    })
}

/// Why a law is no function of position, velocity and load, and which is nearest.
fn nearest(law: &Law) -> (String, Option<(Law, String)>) {
    let memory = "it remembers the path, and a function of position and velocity does not".to_owned();
    let stribeck = |coulomb: f64, at_rest: f64, velocity: f64| {
        Some((Law::Stribeck(Stribeck { coulomb, at_rest, velocity }), "the friction that it has at constant speed".to_owned()))
    };
    let coulomb = |force: f64, what: &str| Some((Law::Coulomb(Coulomb { force }), format!("Coulomb friction of {what}")));
    match law {
        Law::Dahl(l) => (memory, coulomb(l.coulomb, "the level that it comes to")),
        Law::Lugre(l) => (memory, stribeck(l.coulomb, l.at_rest, l.velocity)),
        Law::PreisachLugre(l) => (memory, stribeck(l.coulomb, l.at_rest.max(l.coulomb), l.velocity)),
        Law::MaxwellSlip(l) => (memory, coulomb(l.force.iter().sum(), "the sum of its sliders")),
        Law::WarmFriction(l) => ("it falls with temperature, which is not measured".to_owned(), coulomb(l.force, "its level when cold")),
        Law::HystereticSpring(_) | Law::BoucWen(_) | Law::Creep(_) => (memory, None),
        Law::Backlash(_) | Law::Contact(_) | Law::HuntCrossley(_) => ("a stop is to be felt, and not to be made good".to_owned(), None),
        Law::Inerter(_) => ("it acts by acceleration, which is no argument of the function".to_owned(), None),
        other => (format!("no term for {}", other.kind().name.replace('_', " ")), None),
    }
}
