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
use backdrive_plant::servo::{Number, Numbers, ServoJoint};
use std::fmt::Write;

/// Time step, s: friction is of first order in it, and a joint that holds a load creeps in proportion to it.
const STEP: f64 = 5e-4;
/// Share of a joint's inertia that a weight written for its moment may have, without a robot.
const OF_WEIGHT: f64 = 1e-2;
/// m/s².
const FREE_FALL: f64 = 9.81;
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

    /// What a joint of MuJoCo has no attribute for; `index`: of the servo in the model, `has_moment`: whether a weight is written for the moment.
    fn left_out(&self, index: usize, has_moment: bool) -> Vec<LeftOut> {
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
        leave(Number::DeadBand, "MuJoCo's position actuators have no dead band", "");
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
        let friction = joint.n(Number::Friction) + joint.n(Number::LoadFriction) * cos.abs();
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
        left_out.extend(joint.left_out(index, true));
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
    let known: Vec<f64> = model.servos.iter().map(|s| s.numbers[Number::Gravity]).filter(|g| *g > 0.0).map(f64::recip).collect();
    let Some(usual) = middle(known) else {
        let mut exported = alone(model, integration);
        let why = "no proportional gain is known in N m/rad, so servos and masses have no common scale";
        let left = LeftOut::key(Part::Robot, &arm.robot.name, "links", why, None);
        exported.left_out.push(left.replaced_by("each joint for itself"));
        exported.notes.push(
            "no joint's [servo] has a gravity above 0. Motions that change the weight at a joint, in a new diagnosis, determine its gain"
                .to_owned(),
        );
        return Ok(exported);
    };
    let mut joined = model.clone();
    let links = arm.inertia_at_pose(model.bodies.len());
    let weights = weights(arm);
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
        let weight = weights.get(coordinate).copied().unwrap_or(0.0).abs();
        add(&mut joined, body, &servo.joint, &servo.numbers, gain, weight);
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
        left_out.extend(joint.left_out(index, false));
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
fn add(joined: &mut Model, body: usize, joint: &str, numbers: &Numbers, gain: f64, weight: f64) {
    let mut element = |what: &str, law: Law| {
        joined.elements.push(Element { name: format!("{joint}_{what}"), between: [Some(body), None], law });
    };
    element("damping", Law::Damper(Damper { damping: gain * numbers[Number::Damping] }));
    let drag = gain * numbers[Number::QuadraticDamping];
    if drag > 0.0 {
        element("drag", Law::QuadraticDrag(QuadraticDrag { coefficient: drag }));
    }
    let force = gain * numbers[Number::Friction] + numbers[Number::LoadFriction] * weight;
    if force > 0.0 {
        element("friction", Law::Coulomb(Coulomb { force }));
    }
}

/// Torque of gravity at each coordinate at the pose, N m.
fn weights(arm: &Arm) -> Vec<f64> {
    let mut work = arm.tree.workspace();
    let mut forces = vec![0.0; arm.tree.len()];
    arm.tree.gravity(&arm.pose, &mut work, &mut forces);
    let turns = arm.tree.coordinates().iter().map(|c| c.kind == JointKind::Revolute);
    forces.into_iter().zip(turns).map(|(force, turns)| if turns { force } else { 0.0 }).collect()
}

fn middle(mut all: Vec<f64>) -> Option<f64> {
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}
