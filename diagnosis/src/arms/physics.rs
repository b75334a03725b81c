//! The effects that a joint may have, each as columns of the regression.

use crate::arms::motion::{Motion, Rates};
use crate::arms::problem::Problem;
use crate::arms::rigid::Signals;
use crate::arms::soft::{Gear, change};
use crate::hypothesis::Family;
use backdrive_plant::robot::Tree;
use backdrive_signal::statistics::rms;

/// An effect that a search can add to an arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Physics {
    /// Viscous friction.
    Damper,
    /// Dry friction.
    Coulomb,
    /// Dry friction whose excess at rest falls with speed.
    Stribeck,
    /// Dry friction in proportion to the torque that the joint passes on.
    LoadFriction,
    /// Dry friction whose direction turns over a displacement, not at once.
    Presliding,
    /// Viscous friction that differs by direction.
    AsymmetricDamper,
    /// Drag with the square of speed.
    QuadraticDrag,
    /// A constant torque, or dry friction that differs by direction, which is the same thing while the joint moves.
    Bias,
    /// A spring to ground.
    Spring,
    /// A torque that repeats with position.
    Cogging,
    /// Inertia that turns with the joint alone, such as a rotor behind its gear.
    Inertia,
    /// Torque that is read by a wrong factor (torque constant), at a joint or at all.
    Gain,
    /// A joint whose zero differs from that of its sensor.
    Offset,
    /// A mass at the last link.
    Payload,
    /// Gravity that pulls in another direction: the base is tilted.
    GravityDirection,
    /// Torque of another joint that the motor of this one carries too (belt, differential).
    Coupling,
    /// Friction on the motion of a joint against another one.
    CoupledFriction,
    /// Torque that comes late.
    Delay,
    /// A gear that gives way like a spring between motor and link.
    Compliance,
    /// Play of the gear.
    Backlash,
}

/// Everything that is known of an effect.
pub struct Facts {
    /// Name in verdicts: an element kind, the key of a signal, or one that only arms have.
    pub name: &'static str,
    /// In words.
    pub words: &'static str,
    /// What it belongs to.
    pub family: Family,
    /// Whether its first number may not be below 0.
    pub positive: bool,
    /// Parameters that it adds to a fit, those of its shape too.
    pub numbers: usize,
}

/// All of them, the simplest first.
pub const ALL: [Physics; 20] = [
    Physics::Damper,
    Physics::Coulomb,
    Physics::Inertia,
    Physics::Bias,
    Physics::Gain,
    Physics::Offset,
    Physics::Payload,
    Physics::GravityDirection,
    Physics::LoadFriction,
    Physics::Coupling,
    Physics::Stribeck,
    Physics::Presliding,
    Physics::Spring,
    Physics::Cogging,
    Physics::AsymmetricDamper,
    Physics::QuadraticDrag,
    Physics::CoupledFriction,
    Physics::Delay,
    Physics::Compliance,
    Physics::Backlash,
];

impl Physics {
    /// What is known of it.
    pub fn facts(self) -> Facts {
        let facts = |name, words, family, positive, numbers| Facts { name, words, family, positive, numbers };
        match self {
            Physics::Damper => facts("damper", "viscous friction", Family::Damping, true, 1),
            Physics::Coulomb => facts("coulomb", "dry friction", Family::Friction, true, 1),
            Physics::Stribeck => facts("stribeck", "dry friction that falls with speed", Family::Friction, true, 2),
            Physics::LoadFriction => facts("load_friction", "dry friction that grows with the load", Family::Friction, true, 1),
            Physics::Presliding => facts("dahl", "dry friction with presliding", Family::Friction, true, 2),
            Physics::AsymmetricDamper => {
                facts("asymmetric_damper", "viscous friction that differs by direction", Family::Damping, false, 1)
            }
            Physics::QuadraticDrag => facts("quadratic_drag", "drag with the square of speed", Family::Damping, true, 1),
            Physics::Bias => facts("bias", "a constant torque", Family::Bias, false, 1),
            Physics::Spring => facts("spring", "a spring to ground", Family::Stiffness, true, 2),
            Physics::Cogging => facts("cogging", "cogging", Family::Ripple, false, 3),
            Physics::Inertia => facts("inertia", "armature", Family::Inertia, true, 1),
            Physics::Gain => facts("gain", "a wrong torque constant", Family::Scale, false, 1),
            Physics::Offset => facts("offset", "a zero offset of the position sensor", Family::Bias, false, 1),
            Physics::Payload => facts("payload", "a payload", Family::Inertia, true, 1),
            Physics::GravityDirection => facts("gravity_direction", "a wrong direction of gravity", Family::Bias, false, 2),
            Physics::Coupling => facts("coupling", "torque of another joint in this motor", Family::Scale, false, 1),
            Physics::CoupledFriction => facts("coupled_friction", "dry friction against another joint's motion", Family::Friction, true, 1),
            Physics::Delay => facts("delay", "a delay", Family::Lag, true, 1),
            Physics::Compliance => facts("series_compliance", "a soft gear", Family::Compliance, true, 2),
            Physics::Backlash => facts("backlash", "play of the gear", Family::Contact, true, 2),
        }
    }
}

/// Where an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum At {
    /// At a joint.
    Joint(usize),
    /// At the first joint, by what the second one does.
    Pair(usize, usize),
    /// At the arm as a whole.
    Base,
}

impl At {
    /// The joint that is named for it: that where it shows; of the arm as a whole none.
    pub fn joint(self) -> Option<usize> {
        match self {
            At::Joint(j) | At::Pair(j, _) => Some(j),
            At::Base => None,
        }
    }
}

/// An effect at a place, with the parameters in which the torque is not linear.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// What.
    pub physics: Physics,
    /// Where.
    pub at: At,
    /// Stribeck: speed, rad/s or m/s. Presliding: displacement to full slip, rad or m. Cogging: period, rad or m. Coupled friction: ratio.
    /// Compliance: stiffness, N m/rad or N/m, and a second number where the link swings. Backlash: gap, rad or m. Payload: 1 where its place is free. Offset and direction of gravity: their values of the fit before, for what is of second order.
    pub shape: Vec<f64>,
    /// The element of the nominal model that it is; `None` for what a search has added.
    pub given: Option<usize>,
}

impl Term {
    /// What a search adds.
    pub fn new(physics: Physics, at: At, shape: Vec<f64>) -> Term {
        Term { physics, at, shape, given: None }
    }

    /// Whether another one is the same effect at the same place.
    pub fn is_like(&self, other: &Term) -> bool {
        self.physics == other.physics && self.at == other.at
    }
}

/// A signal at each joint where it shows.
pub type AtJoints = Vec<(usize, Vec<f64>)>;

/// What columns are made of: a motion, and what is known of its torques.
pub struct Sight<'a> {
    /// The arm.
    pub problem: &'a Problem,
    /// The motion.
    pub motion: &'a Motion,
    /// Rates of its samples.
    pub rates: &'a Rates,
    /// The links.
    pub tree: &'a Tree,
    /// Torque that the rigid links take, which is what the joints pass on.
    pub load: &'a Signals,
    /// Inertia of each joint about itself, the others held.
    pub inertia: &'a Signals,
    /// Of each joint's zero: derivative of all rigid torques by it.
    pub by_position: &'a [Signals],
    /// The same, second derivative.
    pub curved: &'a [Signals],
    /// Rigid torques per rad of tilt of gravity, in two directions, and those of gravity itself.
    pub by_tilt: &'a [Signals],
    /// Torque per unit of each inertial parameter of the last body.
    pub by_payload: &'a [Signals],
    /// Of each joint the displacement over which friction turns its direction, rad or m.
    pub slip: &'a [f64],
}

/// Direction of dry friction along a motion, -1 to 1: it turns over a displacement, and stays while the joint rests. It is an elasto-plastic spring
/// whose deflection ends at `displacement`, with one Maxwell element as in Lampaert, Swevers & Al-Bender 2002.
pub fn direction(position: impl Iterator<Item = f64>, displacement: f64) -> Vec<f64> {
    let (mut state, mut before): (f64, Option<f64>) = (0.0, None);
    position
        .map(|q| {
            if let Some(p) = before {
                state = (state + (q - p) / displacement).clamp(-1.0, 1.0);
            }
            before = Some(q);
            state
        })
        .collect()
}

/// Dry friction with presliding along a motion, in its level: `dz = dq / displacement (1 - z sgn dq)` (Dahl 1968), exact for each step.
pub fn dahl(position: impl Iterator<Item = f64>, displacement: f64) -> Vec<f64> {
    let (mut state, mut before): (f64, Option<f64>) = (0.0, None);
    position
        .map(|q| {
            if let Some(p) = before.filter(|p| *p != q) {
                let end = (q - p).signum();
                state = end + (state - end) * (-(q - p).abs() / displacement).exp();
            }
            before = Some(q);
            state
        })
        .collect()
}

/// How many linear numbers a term has.
pub(crate) fn columns_of(term: &Term) -> usize {
    match term.physics {
        Physics::Spring | Physics::Cogging | Physics::GravityDirection => 2,
        Physics::Payload if !term.shape.is_empty() => 4,
        _ => 1,
    }
}

impl Sight<'_> {
    fn direction(&self, joint: usize) -> Vec<f64> {
        direction(self.motion.position[joint].iter().copied(), self.slip[joint])
    }

    /// Columns of a term: for each of its linear numbers the signals at the joints where it shows, before any filter.
    pub fn columns(&self, term: &Term) -> Vec<AtJoints> {
        let motion = self.motion;
        let shape = |i: usize| term.shape.get(i).copied().unwrap_or(1.0);
        let (j, other) = match term.at {
            At::Joint(j) => (j, j),
            At::Pair(j, k) => (j, k),
            At::Base => (self.problem.joints.len().saturating_sub(1), 0),
        };
        let v = &motion.velocity[j];
        let q = &motion.position[j];
        let one = |signal: Vec<f64>| vec![vec![(j, signal)]];
        let all = |signals: &Signals, factor: f64| -> AtJoints {
            signals.iter().enumerate().map(|(k, s)| (k, s.iter().map(|x| factor * x).collect())).collect()
        };
        match term.physics {
            Physics::Damper => one(v.clone()),
            Physics::Coulomb => one(self.direction(j)),
            Physics::Stribeck => one(self.direction(j).iter().zip(v).map(|(s, v)| s * (-(v / shape(0)).powi(2)).exp()).collect()),
            Physics::LoadFriction => one(self.direction(j).iter().zip(&self.load[j]).map(|(s, l)| s * l.abs()).collect()),
            Physics::Presliding => one(dahl(q.iter().copied(), shape(0))),
            Physics::AsymmetricDamper => one(v.iter().map(|v| v.abs()).collect()),
            Physics::QuadraticDrag => one(v.iter().map(|v| v * v.abs()).collect()),
            Physics::Bias => one(vec![1.0; v.len()]),
            Physics::Spring => vec![vec![(j, q.clone())], vec![(j, vec![1.0; q.len()])]],
            Physics::Cogging => {
                let wave = |f: fn(f64) -> f64| q.iter().map(|q| f(std::f64::consts::TAU * q / shape(0))).collect::<Vec<f64>>();
                vec![vec![(j, wave(f64::sin))], vec![(j, wave(f64::cos))]]
            }
            Physics::Inertia => one(motion.acceleration[j].clone()),
            Physics::Gain if term.at == At::Base => vec![all(self.load, 1.0)],
            Physics::Gain => one(self.load[j].clone()),
            Physics::Offset => {
                // τ(q - o) - τ(q) = -o τ' + o²/2 τ'', with o of the square from the fit before.
                let half = 0.5 * term.shape.first().copied().unwrap_or(0.0);
                vec![plus(all(&self.by_position[j], -1.0), &self.curved[j], half)]
            }
            Physics::Payload => match self.problem.bodies.tip.filter(|_| term.shape.is_empty()) {
                Some(tip) => {
                    let p = crate::arms::inertial::of_point(&tip);
                    let mut sum: Signals = vec![vec![0.0; v.len()]; self.load.len()];
                    for (signals, factor) in self.by_payload.iter().zip(p) {
                        for (s, x) in sum.iter_mut().zip(signals) {
                            s.iter_mut().zip(x).for_each(|(s, x)| *s += factor * x);
                        }
                    }
                    vec![all(&sum, 1.0)]
                }
                None => self.by_payload.iter().take(4).map(|s| all(s, 1.0)).collect(),
            },
            Physics::GravityDirection => {
                // A direction keeps its length: what is tilted sideways by a and b pulls (a² + b²)/2 less downwards.
                let Some((down, sideways)) = self.by_tilt.split_last() else { return Vec::new() };
                let before = |i: usize| term.shape.get(i).copied().unwrap_or(0.0);
                sideways.iter().enumerate().map(|(i, s)| plus(all(s, 1.0), down, -0.5 * before(i))).collect()
            }
            // The measured torque: the motor carries the other joint's friction too.
            Physics::Coupling => one(motion.torque[other].clone()),
            Physics::CoupledFriction => {
                let ratio = shape(0);
                let both = q.iter().zip(&motion.position[other]).map(|(a, b)| a + ratio * b);
                let s = direction(both, self.slip[j].max(self.slip[other]));
                let on_other = s.iter().map(|s| ratio * s).collect();
                vec![vec![(j, s), (other, on_other)]]
            }
            Physics::Delay => {
                let late = backdrive_signal::derivative(&self.load[j], self.rates.period());
                one(late.iter().map(|x| -x).collect())
            }
            // Per unit of what gives way, 1/k or the gap: where the shape is right, the number is that.
            Physics::Compliance | Physics::Backlash => {
                let (gear, unit) = match term.physics {
                    Physics::Compliance if term.shape.len() > 1 => (Gear::Swinging(shape(0)), shape(0)),
                    Physics::Compliance => (Gear::Spring(shape(0)), shape(0)),
                    _ => (Gear::Play(shape(0)), 1.0 / shape(0).max(f64::MIN_POSITIVE)),
                };
                vec![all(&change(self.tree, motion, j, self.load, &self.inertia[j], self.rates.period(), gear), unit)]
            }
        }
    }
}

fn plus(mut signals: AtJoints, other: &Signals, factor: f64) -> AtJoints {
    for ((_, signal), other) in signals.iter_mut().zip(other) {
        signal.iter_mut().zip(other).for_each(|(s, o)| *s += factor * o);
    }
    signals
}

/// Whether logs differ by what the arm is known to carry.
pub fn several_payloads(motions: &[Motion]) -> bool {
    motions.windows(2).any(|pair| pair[0].payload != pair[1].payload)
}

/// Every effect at every place, with the shapes that a search tries first.
pub fn candidates(problem: &Problem, motions: &[Motion]) -> Vec<Term> {
    let joints = problem.joints.len();
    let mut out = Vec::new();
    for physics in ALL {
        for j in 0..joints {
            let at = At::Joint(j);
            match physics {
                Physics::Payload | Physics::GravityDirection => {
                    if j > 0 {
                        continue;
                    }
                    if physics == Physics::GravityDirection || problem.bodies.tip.is_some() {
                        out.push(Term::new(physics, At::Base, Vec::new()));
                    }
                    if physics == Physics::Payload {
                        out.push(Term::new(physics, At::Base, vec![1.0]));
                    }
                }
                // One factor for all is the same as other masses, but for a mass that is known.
                Physics::Gain if j == 0 && several_payloads(motions) => {
                    out.extend([At::Base, at].map(|at| Term::new(physics, at, Vec::new())));
                }
                Physics::Coupling => out.extend((0..joints).filter(|k| *k != j).map(|k| Term::new(physics, At::Pair(j, k), Vec::new()))),
                Physics::CoupledFriction => {
                    // q_j - q_k is the same motion as q_k - q_j.
                    out.extend((0..j).flat_map(|k| [-1.0, 1.0].map(|r| Term::new(physics, At::Pair(j, k), vec![r]))));
                }
                Physics::Stribeck => {
                    let fast = rms(motions.iter().flat_map(|m| m.velocity[j].iter().copied()));
                    out.extend([0.03, 0.06, 0.12, 0.25, 0.5, 0.8, 1.2].map(|s| Term::new(physics, at, vec![s * fast.max(1e-9)])));
                }
                Physics::Presliding => {
                    let wide = range(motions.iter().flat_map(|m| m.position[j].iter().copied()));
                    out.extend(PRESLIDING.map(|s| Term::new(physics, at, vec![s * wide.max(1e-9)])));
                }
                Physics::Cogging => {
                    let wide = range(motions.iter().flat_map(|m| m.position[j].iter().copied())).max(1e-9);
                    out.extend(periods(wide, problem.tree.coordinates()[j].kind).into_iter().map(|p| Term::new(physics, at, vec![p])));
                }
                // What the file has behind a motor of its own is not sought again.
                Physics::Compliance | Physics::Backlash if problem.geared[j] => {}
                Physics::Compliance => {
                    let inertia = usual_inertia(problem, motions, j);
                    let stiffness = RESONANCES.map(|f| inertia * (std::f64::consts::TAU * f).powi(2));
                    out.extend(stiffness.map(|k| Term::new(physics, at, vec![k])));
                    out.extend(stiffness.map(|k| Term::new(physics, at, vec![k, 1.0])));
                }
                Physics::Backlash => {
                    let wide = range(motions.iter().flat_map(|m| m.position[j].iter().copied()));
                    out.extend(GAPS.map(|s| Term::new(physics, at, vec![s * wide.max(1e-9)])));
                }
                _ => out.push(Term::new(physics, at, Vec::new())),
            }
        }
    }
    out
}

/// Resonances of the link on its gear that are tried first, Hz.
const RESONANCES: [f64; 8] = [2.5, 3.5, 5.0, 7.0, 10.0, 14.0, 20.0, 30.0];
/// Displacements of presliding that are tried first, as shares of the joint's range.
const PRESLIDING: [f64; 8] = [0.002, 0.004, 0.007, 0.012, 0.02, 0.035, 0.06, 0.1];
/// Gaps that are tried first, as shares of the joint's range.
const GAPS: [f64; 7] = [0.001, 0.002, 0.004, 0.008, 0.016, 0.032, 0.064];

/// Inertia of a joint about itself in the middle of a log, kg m² or kg.
fn usual_inertia(problem: &Problem, motions: &[Motion], joint: usize) -> f64 {
    let mut work = problem.tree.workspace();
    let count = problem.joints.len();
    let mut matrix = nalgebra::DMatrix::zeros(count, count);
    let middle: Vec<f64> = motions.first().map_or(Vec::new(), |m| m.position.iter().filter_map(|q| q.get(q.len() / 2).copied()).collect());
    if middle.len() < count {
        return 1.0;
    }
    problem.tree.mass_matrix(&middle, &mut work, &mut matrix);
    matrix[(joint, joint)]
}

/// Periods of ripple that are tried: of a joint that turns whole fractions of a turn; of one that slides a geometric series.
fn periods(wide: f64, kind: backdrive_plant::robot::JointKind) -> Vec<f64> {
    match kind {
        backdrive_plant::robot::JointKind::Revolute => {
            (2..=200).map(|n| std::f64::consts::TAU / f64::from(n)).filter(|p| *p < 0.6 * wide).collect()
        }
        _ => (0..60).map(|i| 0.5 * wide * 0.93f64.powi(i)).collect(),
    }
}

pub(crate) fn range(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    if high > low { high - low } else { 0.0 }
}
