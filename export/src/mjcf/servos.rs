//! Joints that position servos drive: a position actuator, damping, dry friction and armature at each.
//!
//! A servo's parameters are forces over its proportional gain, so they are multiplied by that gain here. MuJoCo's `position` is its `general` with
//! `gainprm="kp"` and `biasprm="0 -kp -kv"`; the general form is written where the command has a ratio or an offset.

use super::attributes::Integration;
use super::document::{head, names_in, of_arm};
use super::layout::Layout;
use super::network::network;
use super::signals::{Signals, delay};
use crate::left_out::{Change, LeftOut, Part};
use crate::xml::{escaped, number};
use crate::{ExportError, Exported, of_robot};
use backdrive_plant::elements::{Coulomb, Damper, Law, QuadraticDrag};
use backdrive_plant::model::{Element, Model};
use backdrive_plant::robot::{Arm, JointKind};
use backdrive_plant::servo::{Number, ServoJoint};
use std::f64::consts::FRAC_PI_2;
use std::fmt::Write;

/// Time step, s: friction is of first order in it, and a joint that holds a load creeps in proportion to it.
const STEP: f64 = 5e-4;
/// Share of a joint's inertia that a weight written for its moment may have, without a robot.
const OF_WEIGHT: f64 = 1e-2;
/// m/s².
const FREE_FALL: f64 = 9.81;
/// A joint carries weight if its largest torque is more than this share of the arm's largest.
const CARRIES: f64 = 0.05;
/// Armature that is written at least, as a share of the servo's inertia.
const LEAST_ARMATURE: f64 = 1e-3;

/// A model whose joints position servos drive. `step` is the time step, s.
///
/// # Errors
/// Where the robot cannot be written.
pub(super) fn export(model: &Model, step: Option<f64>) -> Result<Exported, ExportError> {
    let delays = model.servos.iter().map(|s| s.numbers[Number::Delay]).filter(|d| *d > 0.0);
    let step = step.unwrap_or_else(|| delays.fold(STEP, f64::min));
    let integration = Integration { step, integrator: "implicitfast" };
    match &model.arm {
        None => Ok(alone(model, integration)),
        Some(arm) => on_robot(model, arm, integration),
    }
}

/// A joint with its parameters in N m.
struct Scaled<'a> {
    servo: &'a ServoJoint,
    /// Proportional gain, N m/rad.
    gain: f64,
}

impl Scaled<'_> {
    fn n(&self, number: Number) -> f64 {
        self.servo.numbers[number]
    }

    /// The position actuator. The delay is a whole number of steps, as a held command is.
    fn actuator(&self, integration: Integration) -> String {
        let (name, kp) = (escaped(&self.servo.joint), self.gain);
        let (ratio, offset) = (self.n(Number::Gain), self.n(Number::Offset));
        let mut text = match ratio == 1.0 && offset == 0.0 {
            true => format!("    <position name=\"{name}\" joint=\"{name}\" kp=\"{}\" kv=\"0\"", number(kp)),
            false => format!(
                "    <general name=\"{name}\" joint=\"{name}\" dyntype=\"none\" gaintype=\"fixed\" biastype=\"affine\" gainprm=\"{}\" biasprm=\"{} {} 0\"",
                number(kp * ratio),
                number(kp * offset),
                number(-kp)
            ),
        };
        let limit = kp * self.n(Number::Limit);
        // Writing to a String cannot fail.
        let _ = match self.n(Number::Limit) < 1e8 {
            true => write!(text, " forcelimited=\"true\" forcerange=\"{} {}\"", number(-limit), number(limit)),
            false => write!(text, " forcelimited=\"false\""),
        };
        let steps = (self.n(Number::Delay) / integration.step).round();
        text += &delay(steps * integration.step, integration.step, "zoh");
        text + " ctrllimited=\"false\"/>\n"
    }

    /// Dry friction as MuJoCo gets it, rad. A dead band holds the joint in the same range of angles as friction does, and both leave the same error in motion.
    /// `weight`: the load in rad.
    fn friction(&self, weight: f64) -> f64 {
        self.n(Number::Friction) + self.n(Number::DeadBand) + self.n(Number::LoadFriction) * weight
    }

    /// What a joint of MuJoCo has no attribute for; `index`: of the servo in the model, `has_moment`: whether a weight is written for the moment, `weight`: the
    /// load in rad.
    fn left_out(&self, index: usize, has_moment: bool, weight: f64) -> Vec<LeftOut> {
        let servo = self.servo;
        let mut out = Vec::new();
        let mut leave = |n: Number, why: &str, instead: &str| {
            let facts = n.facts();
            if servo.numbers[n] != facts.nothing {
                let left = LeftOut::key(Part::Input, &servo.joint, facts.key, why, Some(Change::NoServo(index, n)));
                out.push(if instead.is_empty() { left } else { left.replaced_by(instead) });
            }
        };
        if servo.numbers[Number::Delay] < 0.0 {
            leave(Number::Delay, "MuJoCo cannot act ahead of its command", "");
        }
        leave(Number::Stribeck, "MuJoCo's dry friction has one level, which does not fall with speed", "its level at speed");
        leave(Number::DeadBand, "MuJoCo's position actuators have no dead band", "dry friction of the same width");
        leave(Number::Play, "MuJoCo's position actuators have no play", "");
        leave(Number::Speed, "MuJoCo's actuators have no profile: limit the speed of the command", "");
        leave(Number::Acceleration, "MuJoCo's actuators have no profile: limit the acceleration of the command", "");
        leave(Number::Lead, "MuJoCo's actuators do not differentiate their command: add its derivative to it", "");
        leave(Number::Integral, "MuJoCo's position actuators have no integral term", "");
        leave(
            Number::LoadFriction,
            "MuJoCo's dry friction has one level, which no load changes",
            "its level at the pose of the robot file",
        );
        if has_moment {
            leave(Number::Gravity, "the weight of the links is not written", "");
        } else {
            let why = "a weight that the robot file does not contain has no known place among the links";
            leave(Number::MomentCos, why, "");
            leave(Number::MomentSin, why, "");
        }
        for left in &mut out {
            let more = match left.kind.as_str() {
                "dead_band" => servo.numbers[Number::DeadBand],
                "load_friction" => servo.numbers[Number::LoadFriction] * weight,
                _ => continue,
            };
            left.changes.push(Change::MoreServo(index, Number::Friction, more));
        }
        out
    }
}

/// Every joint for itself: a hinge across gravity, with a weight where the servo holds one.
fn alone(model: &Model, integration: Integration) -> Exported {
    let (mut bodies, mut actuators, mut left_out) = (String::new(), String::new(), Vec::new());
    for (index, servo) in model.servos.iter().enumerate() {
        let joint = Scaled { servo, gain: 1.0 };
        let name = escaped(&servo.joint);
        let inertia = joint.n(Number::Inertia);
        let (cos, sin) = (joint.n(Number::MomentCos), joint.n(Number::MomentSin));
        // The mass at which the weight's own inertia is a small share of the joint's.
        let mass = (cos.hypot(sin) / FREE_FALL).powi(2) / (OF_WEIGHT * inertia);
        let mass = mass.max(1e-3 * inertia);
        let (x, z) = (-cos / (mass * FREE_FALL), -sin / (mass * FREE_FALL));
        let own = 1e-3 * inertia;
        let armature = inertia - own - mass * (x * x + z * z);
        let friction = joint.friction(cos.hypot(sin));
        let holds: String = integration.friction().iter().map(|(key, value)| format!(" {key}=\"{value}\"")).collect();
        bodies += &format!(
            "    <body name=\"{name}\" pos=\"0 {} 0\">\n      <joint name=\"{name}\" type=\"hinge\" axis=\"0 1 0\" limited=\"false\" armature=\"{}\" damping=\"{} {}\" \
             frictionloss=\"{}\"{holds}/>\n      <inertial pos=\"{} 0 {}\" mass=\"{}\" diaginertia=\"{own} {own} {own}\"/>\n    </body>\n",
            number(0.1 * index as f64),
            number(armature),
            number(joint.n(Number::Damping)),
            number(joint.n(Number::QuadraticDamping)),
            number(friction),
            number(x),
            number(z),
            number(mass),
            own = number(own),
        );
        actuators += &joint.actuator(integration);
        left_out.extend(joint.left_out(index, true, cos.hypot(sin)));
    }
    let text = format!(
        "<mujoco model=\"{}\">\n{}  <compiler angle=\"radian\"/>\n  <option timestep=\"{}\" integrator=\"{}\" gravity=\"0 0 {}\"/>\n  <worldbody>\n{bodies}  \
         </worldbody>\n  <actuator>\n{actuators}  </actuator>\n</mujoco>\n",
        escaped(&model.name),
        head(model),
        number(integration.step),
        integration.integrator,
        number(-FREE_FALL),
    );
    let notes = vec![
        "no torque scale is known, so every proportional gain is written as 1 N m/rad. For N m, multiply kp, gainprm, \
            biasprm, forcerange, armature, damping, frictionloss, mass and inertia by the gain"
            .to_owned(),
    ];
    Exported { text, left_out, notes }
}

/// The robot with its links, and the servos at its joints.
fn on_robot(model: &Model, arm: &Arm, integration: Integration) -> Result<Exported, ExportError> {
    let mut notes = Vec::new();
    let weights = weights(arm);
    let Some(usual) = common_gain(model, arm, &weights) else {
        let mut exported = alone(model, integration);
        let why = "the proportional gain of a joint with weight is not known in N m/rad, so servos and masses have no common scale";
        let left = LeftOut::key(Part::Robot, &arm.robot.name, "links", why, None);
        exported.left_out.push(left.replaced_by("each joint for itself"));
        exported.notes.push(
            "a joint that carries weight has no gravity above 0 in its [servo]. Motions that change this weight, in a new diagnosis, determine its gain"
                .to_owned(),
        );
        return Ok(exported);
    };
    let mut joined = model.clone();
    let links = arm.inertia_at_pose(model.bodies.len());
    let mut left_out = of_robot(model)?;
    let mut actuators = String::new();
    for (index, servo) in model.servos.iter().enumerate() {
        let Some(coordinate) = arm.tree.coordinates().iter().position(|c| c.name == servo.joint) else { continue };
        let Some(body) = arm.bodies.get(coordinate).copied() else { continue };
        let gravity = servo.numbers[Number::Gravity];
        let gain = if gravity > 0.0 { gravity.recip() } else { usual };
        if gravity <= 0.0 {
            notes.push(format!(
                "the proportional gain of {} is not known: it is written as that of the other joints, {} N m/rad, and its forces with it",
                servo.joint,
                number(gain)
            ));
        }
        let joint = Scaled { servo, gain };
        let weight = weights.get(coordinate).copied().unwrap_or(0.0);
        add(&mut joined, body, &joint, weight / gain);
        let inertia = gain * servo.numbers[Number::Inertia];
        let rest = inertia - links[(body, body)];
        if rest < LEAST_ARMATURE * inertia {
            notes.push(format!(
                "the links have {} kg m² at {}, more than the {} kg m² found there: its armature is written as next to nothing",
                number(links[(body, body)]),
                servo.joint,
                number(inertia)
            ));
        }
        joined.bodies[body].inertia = rest.max(LEAST_ARMATURE * inertia);
        actuators += &joint.actuator(integration);
        left_out.extend(joint.left_out(index, false, weight / gain));
    }
    let layout = Layout::of(&joined);
    let (network, more) = network(&joined, &layout.pose, names_in(model, "tendon"));
    left_out.extend(more);
    let signals = Signals { actuators, ..Signals::default() };
    let text = of_arm(&joined, arm, &layout, &network, &signals, integration, (&mut notes, &mut left_out))?;
    notes.push(
        "gains in N m/rad rest on the masses of the robot file. The links' inertia acts in MuJoCo as it changes with the pose, and between \
            joints; in the servo model it is one number for each joint"
            .to_owned(),
    );
    Ok(Exported { text, left_out, notes })
}

/// Damping, drag and dry friction of a servo as elements of its joint.
fn add(joined: &mut Model, body: usize, joint: &Scaled, weight: f64) {
    let name = &joint.servo.joint;
    let mut element = |what: &str, law: Law| {
        joined.elements.push(Element { name: format!("{name}_{what}"), between: [Some(body), None], law });
    };
    element("damping", Law::Damper(Damper { damping: joint.gain * joint.n(Number::Damping) }));
    let drag = joint.gain * joint.n(Number::QuadraticDamping);
    if drag > 0.0 {
        element("drag", Law::QuadraticDrag(QuadraticDrag { coefficient: drag }));
    }
    let force = joint.gain * joint.friction(weight);
    if force > 0.0 {
        element("friction", Law::Coulomb(Coulomb { force }));
    }
}

/// The usual gain of joints that carry weight, N m/rad, if each of them has a known one: a weight that the servo model does not have would move the joint.
fn common_gain(model: &Model, arm: &Arm, weights: &[f64]) -> Option<f64> {
    let heaviest = weights.iter().copied().fold(0.0, f64::max);
    let carries = |servo: &&ServoJoint| {
        let coordinate = arm.tree.coordinates().iter().position(|c| c.name == servo.joint);
        coordinate.is_some_and(|c| weights[c] > CARRIES * heaviest)
    };
    let gains: Vec<f64> = model.servos.iter().filter(carries).map(|s| s.numbers[Number::Gravity]).collect();
    middle(gains.iter().map(|g| (*g > 0.0).then(|| g.recip())).collect::<Option<Vec<f64>>>()?)
}

/// Largest torque of gravity at each coordinate, N m, at the pose and with one coordinate a quarter turn from it.
fn weights(arm: &Arm) -> Vec<f64> {
    let mut work = arm.tree.workspace();
    let (mut forces, mut most) = (vec![0.0; arm.tree.len()], vec![0.0f64; arm.tree.len()]);
    let turns = |c: usize| arm.tree.coordinates()[c].kind == JointKind::Revolute;
    let moved = (0..arm.tree.len()).filter(|c| turns(*c)).flat_map(|c| [(c, FRAC_PI_2), (c, -FRAC_PI_2)]);
    for (coordinate, by) in moved.chain([(0, 0.0)]) {
        let mut pose = arm.pose.clone();
        pose.iter_mut().skip(coordinate).take(1).for_each(|q| *q += by);
        arm.tree.gravity(&pose, &mut work, &mut forces);
        most.iter_mut().zip(&forces).for_each(|(most, force)| *most = most.max(force.abs()));
    }
    most
}

fn middle(mut all: Vec<f64>) -> Option<f64> {
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}
