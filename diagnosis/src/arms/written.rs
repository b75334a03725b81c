//! The model with what was found: links, joint networks and pose, as a model that simulates and exports as any other.

use crate::arms::error::ArmError;
use crate::arms::fit::Fit;
use crate::arms::physics::{At, Physics, Term};
use crate::arms::regression::{Data, parts_of};
use crate::arms::rigid::across;
use crate::arms::soft::DAMPING;
use backdrive_plant::elements::{
    AsymmetricDamper, Backlash, Bias, Cogging, Coulomb, Dahl, Damper, Law, LoadFriction, QuadraticDrag, Spring, Stribeck,
};
use backdrive_plant::model::{Body, Element, Model, OutputKind};
use backdrive_plant::robot::Arm;
use nalgebra::Vector3;

/// Resonance of the stiff joint that a friction which grows with the load is given, Hz: the load has to pass through something.
const STIFF_HZ: f64 = 60.0;

/// How the measured torques relate to those of the joints: `measured = gain (own + Σ ratio other)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// By joint.
    pub gain: Vec<f64>,
    /// Joint, other joint, ratio.
    pub coupling: Vec<(usize, usize, f64)>,
    /// By joint, rad or m: the sensor's offset.
    pub offset: Vec<f64>,
    /// By joint: whether the position is that of a motor whose gear gives way.
    pub of_motor: Vec<bool>,
}

impl Reading {
    /// That of a fit.
    pub fn of(data: &Data, fit: &Fit) -> Reading {
        let joints = data.problem.joints.len();
        let mut out = Reading { gain: vec![1.0; joints], coupling: Vec::new(), offset: vec![0.0; joints], of_motor: vec![false; joints] };
        for (term, place) in fit.structure.terms.iter().zip(&fit.places) {
            let value = fit.values[place.start];
            match (term.physics, term.at) {
                (Physics::Gain, At::Joint(j)) => out.gain[j] += value,
                (Physics::Gain, At::Base) => out.gain.iter_mut().for_each(|gain| *gain += value),
                (Physics::Coupling, At::Pair(j, k)) => out.coupling.push((j, k, value)),
                (Physics::Offset, At::Joint(j)) => out.offset[j] += value,
                (Physics::Compliance | Physics::Backlash, At::Joint(j)) => out.of_motor[j] = true,
                _ => {}
            }
        }
        out
    }

    /// Torques of the joints from measured ones, in place.
    pub fn undo(&self, measured: &mut [f64]) {
        let read = measured.to_vec();
        for (j, k, ratio) in &self.coupling {
            measured[*j] -= ratio * read[*k];
        }
        measured.iter_mut().zip(&self.gain).for_each(|(m, g)| *m /= g);
    }
}

/// Gravity that a fit has found.
pub fn gravity_of(data: &Data, fit: &Fit) -> Vector3<f64> {
    let gravity = data.problem.robot.gravity;
    let found = fit.structure.terms.iter().zip(&fit.places).find(|(t, _)| t.physics == Physics::GravityDirection);
    let Some((_, place)) = found else { return gravity };
    let [a, b] = across(&gravity);
    let tilted = gravity + gravity.norm() * (a * fit.values[place.start] + b * fit.values[place.start + 1]);
    tilted * (gravity.norm() / tilted.norm().max(1e-12))
}

/// The model of a fit, and what of it no model file can say.
///
/// # Errors
/// Where the robot cannot be computed with it.
pub fn model_of(data: &Data, fit: &Fit) -> Result<(Model, Vec<String>), ArmError> {
    let problem = data.problem;
    let mut model = problem.model.clone();
    let mut notes = Vec::new();
    let Some(arm) = model.arm.take() else { return Err(ArmError::NoRobot(problem.model_file.display().to_string())) };
    let reading = Reading::of(data, fit);
    let mut inertial = data.parameters(fit);
    for (term, place) in fit.structure.terms.iter().zip(&fit.places).filter(|(t, _)| t.physics == Physics::Payload) {
        let Some(last) = inertial.last_mut() else { continue };
        let added = match data.problem.bodies.tip.filter(|_| term.shape.is_empty()) {
            Some(tip) => crate::arms::inertial::of_point(&tip).map(|x| x * fit.values[place.start]),
            None => {
                let v = &fit.values[place.clone()];
                let centre = Vector3::new(v[1], v[2], v[3]) / v[0].max(1e-9);
                crate::arms::inertial::of_point(&centre).map(|x| x * v[0])
            }
        };
        last.iter_mut().zip(added).for_each(|(p, a)| *p += a);
    }
    let mut robot = problem.bodies.applied(&problem.robot, &inertial);
    robot.gravity = gravity_of(data, fit);
    let keeps_text = inertial == problem.bodies.nominal;
    let shifted = robot.joints.iter().any(|j| j.reference != 0.0);
    let xml = match (keeps_text, shifted) {
        (true, _) => arm.xml.clone(),
        (false, true) => {
            notes.push(
                "the robot file has joints whose reference is not 0, which URDF does not support: its inertias are written unchanged"
                    .to_string(),
            );
            robot = problem.robot.clone();
            robot.gravity = gravity_of(data, fit);
            arm.xml.clone()
        }
        (false, false) if is_urdf(&arm.xml) => {
            backdrive_export::urdf::with_inertias(&arm.xml, &problem.robot, &robot).map_err(|e| ArmError::Robot(e.to_string()))?
        }
        (false, false) => {
            notes.push(
                "the robot is written as URDF because its inertias changed: it contains bodies and joints, but no geoms, sites or other \
                    elements of the MJCF"
                    .to_string(),
            );
            backdrive_export::urdf::robot_as_urdf(&robot)
        }
    };
    let mut new = Arm::new(xml, robot, 0).map_err(|e| ArmError::Robot(e.to_string()))?;
    new.bodies.clone_from(&arm.bodies);
    new.pose = arm.pose.iter().zip(&reading.offset).map(|(p, o)| p - o).collect();
    model.arm = Some(Box::new(new));
    elements(data, fit, &reading, &mut model, &mut notes);
    Ok((model, notes))
}

fn is_urdf(xml: &str) -> bool {
    backdrive_plant::robot::RobotFile::is_urdf(xml)
}

/// Parameters of terms at a joint: the sum of the first value of each of this effect, in torques of the joint.
fn at_joint(fit: &Fit, reading: &Reading, joint: usize, physics: Physics) -> Option<(f64, Term, usize)> {
    let (index, term) = fit.structure.terms.iter().enumerate().find(|(_, t)| t.physics == physics && t.at == At::Joint(joint))?;
    Some((fit.values[fit.places[index].start] / reading.gain[joint], term.clone(), index))
}

fn elements(data: &Data, fit: &Fit, reading: &Reading, model: &mut Model, notes: &mut Vec<String>) {
    let problem = data.problem;
    for joint in 0..problem.joints.len() {
        // Nothing is known of a joint whose torque has no sign: it stays as the file has it.
        if data.unsigned[joint] {
            continue;
        }
        let value = |physics| at_joint(fit, reading, joint, physics).map(|f| f.0);
        let second = |physics| at_joint(fit, reading, joint, physics).map(|f| fit.values[fit.places[f.2].start + 1] / reading.gain[joint]);
        let shape = |physics| at_joint(fit, reading, joint, physics).and_then(|f| f.1.shape.first().copied());
        // Effects of the regression are written with new values: elements of the nominal file that are the same effect are replaced.
        let known: Vec<usize> =
            problem.given.iter().filter(|g| g.joint == joint && !parts_of(&g.law).is_empty()).map(|g| g.element).collect();
        let names: Vec<String> = known.iter().filter_map(|i| problem.model.elements.get(*i)).map(|e| e.name.clone()).collect();
        model.elements.retain(|e| !names.contains(&e.name));
        let body = model.arm.as_ref().and_then(|arm| arm.bodies.get(joint).copied()).unwrap_or(joint);
        let not_less = |x: Option<f64>| x.unwrap_or(0.0).max(0.0);
        let level = not_less(value(Physics::Coulomb));
        let mut on = body;
        if let Some(armature) = value(Physics::Inertia) {
            set_armature(problem, model, joint, armature.max(0.0));
        }
        let pose = model.arm.as_ref().and_then(|arm| arm.pose.get(joint).copied()).unwrap_or(0.0);
        let mut laws: Vec<(&str, Law)> = Vec::new();
        let compliance = value(Physics::Compliance).filter(|c| *c > 0.0);
        let gap = value(Physics::Backlash).filter(|g| *g > 0.0);
        let gives_way = compliance.is_some() || gap.is_some();
        if gives_way {
            on = rotor(model, joint, body, &problem.joints[joint], &Gear { compliance, gap }, notes);
            // The drive measures its own position.
            for output in &mut model.outputs {
                match &mut output.kind {
                    OutputKind::Position(of) | OutputKind::Velocity(of) if *of == body => *of = on,
                    _ => {}
                }
            }
        }
        if let Some(c) = value(Physics::LoadFriction).filter(|c| *c > 0.0) {
            if !gives_way {
                on = rotor(model, joint, body, &problem.joints[joint], &Gear::default(), notes);
            }
            laws.push(("friction", Law::LoadFriction(LoadFriction { force: level, coefficient: c * reading.gain[joint] })));
        } else if let (Some(excess), Some(velocity)) = (value(Physics::Stribeck).filter(|x| *x > 0.0), shape(Physics::Stribeck)) {
            laws.push(("friction", Law::Stribeck(Stribeck { coulomb: level, at_rest: level + excess, velocity })));
        } else if level > 0.0 {
            laws.push(("friction", Law::Coulomb(Coulomb { force: level })));
        }
        if value(Physics::LoadFriction).is_some_and(|c| c > 0.0) && value(Physics::Stribeck).is_some() {
            notes.push(format!(
                "friction of joint {} is written without its excess at rest: no element depends on both load and speed",
                problem.joints[joint]
            ));
        }
        let (even, odd) = (value(Physics::Damper), value(Physics::AsymmetricDamper));
        match (even, odd) {
            (b, Some(a)) => {
                let b = b.unwrap_or(0.0);
                laws.push(("damping", Law::AsymmetricDamper(AsymmetricDamper { positive: (b + a).max(0.0), negative: (b - a).max(0.0) })));
            }
            (Some(b), None) if b > 0.0 => laws.push(("damping", Law::Damper(Damper { damping: b }))),
            _ => {}
        }
        if let Some(force) = value(Physics::Bias) {
            laws.push(("bias", Law::Bias(Bias { force })));
        }
        if let Some(coefficient) = value(Physics::QuadraticDrag).filter(|x| *x > 0.0) {
            laws.push(("drag", Law::QuadraticDrag(QuadraticDrag { coefficient })));
        }
        if let (Some(c), Some(d)) = (value(Physics::Presliding).filter(|x| *x > 0.0), shape(Physics::Presliding)) {
            laws.push(("presliding", Law::Dahl(Dahl { stiffness: c / d, coulomb: c })));
        }
        if let (Some(k), Some(b)) = (value(Physics::Spring).filter(|k| *k > 0.0), second(Physics::Spring)) {
            // The fit has k q + b over the coordinate; the network counts from the pose.
            laws.push(("spring", Law::Spring(Spring { stiffness: k, rest: -b / k - pose })));
        }
        if let (Some(s), Some(c), Some(period)) = (value(Physics::Cogging), second(Physics::Cogging), shape(Physics::Cogging)) {
            let phase = c.atan2(s) + std::f64::consts::TAU * pose / period;
            laws.push(("cogging", Law::Cogging(Cogging { amplitude: s.hypot(c), period, phase })));
        }
        for (what, law) in laws {
            let name = free_name(model, &format!("{}_{what}", problem.joints[joint]));
            let end = if what == "friction" || gives_way { on } else { body };
            model.elements.push(Element { name, between: [Some(end), None], law });
        }
    }
    for (term, place) in fit.structure.terms.iter().zip(&fit.places) {
        if let (Physics::CoupledFriction, At::Pair(j, k)) = (term.physics, term.at) {
            let bodies = model.arm.as_ref().map(|arm| (arm.bodies[j], arm.bodies[k]));
            match (term.shape.first(), bodies) {
                (Some(ratio), Some((a, b))) if *ratio == -1.0 => {
                    let name = free_name(model, &format!("{}_{}_friction", problem.joints[j], problem.joints[k]));
                    let law = Law::Coulomb(Coulomb { force: fit.values[place.start].max(0.0) });
                    model.elements.push(Element { name, between: [Some(a), Some(b)], law });
                }
                _ => notes.push("friction on a sum of two joints' motions is no element of a model file and is left out".to_string()),
            }
        }
        if term.physics == Physics::Delay {
            notes.push("the delay is one of the logged torque; the model does not contain it".to_string());
        }
    }
}

/// Sets the inertia that turns with a joint: that of its own body, its network's keeping their shares.
fn set_armature(problem: &crate::arms::problem::Problem, model: &mut Model, joint: usize, armature: f64) {
    let name = &problem.joints[joint];
    let others: f64 = model.bodies.iter().filter(|b| b.name.starts_with(&format!("{name}."))).map(|b| b.inertia).sum();
    if others > 0.0 {
        let factor = armature / problem.armature[joint].max(1e-300);
        model.bodies.iter_mut().filter(|b| b.name.starts_with(&format!("{name}.")) || b.name == *name).for_each(|b| b.inertia *= factor);
    } else if let Some(body) = model.bodies.iter_mut().find(|b| b.name == *name) {
        body.inertia = armature;
    }
}

/// How the gear of a joint gives way: N m/rad or N/m upside down, and rad or m. One that does neither is stiff.
#[derive(Default)]
struct Gear {
    compliance: Option<f64>,
    gap: Option<f64>,
}

/// A rotor before the joint, tied to it by its gear. Forces on the joint act on it from now on.
fn rotor(model: &mut Model, joint: usize, body: usize, name: &str, gear: &Gear, notes: &mut Vec<String>) -> usize {
    let beside = model.arm.as_ref().map_or(1.0, |arm| arm.inertia_at_pose(model.bodies.len())[(body, body)]);
    let own = model.bodies[body].inertia;
    // All that turns with the joint alone is the rotor; where nothing does, so little that it does not matter.
    let inertia = if own > 0.0 { own } else { 0.02 * beside };
    let links = (beside - own).max(0.1 * beside);
    model.bodies[body].inertia = 0.0;
    let at = model.bodies.len();
    model.bodies.push(Body { name: format!("{name}.rotor"), inertia });
    let reduced = inertia * links / (inertia + links);
    let w = std::f64::consts::TAU * STIFF_HZ;
    let (stiffness, damping) = match gear.compliance {
        // What damps a soft gear is not found: as much as the regression supposes.
        Some(c) => (1.0 / c, 2.0 * DAMPING * (links / c).sqrt()),
        None => (reduced * w * w, 0.2 * reduced * w),
    };
    let mut tie = |what: &str, law: Law| {
        model.elements.push(Element { name: free_name(model, &format!("{name}_{what}")), between: [Some(at), Some(body)], law });
    };
    match gear.gap {
        Some(gap) => tie("gear", Law::Backlash(Backlash { gap, stiffness, damping, rounding: 0.0 })),
        None => {
            tie("gear", Law::Spring(Spring { stiffness, rest: 0.0 }));
            tie("gear_damping", Law::Damper(Damper { damping }));
        }
    }
    model.inputs.iter_mut().filter(|i| i.on == body && i.kind == backdrive_plant::model::InputKind::Force).for_each(|i| i.on = at);
    match (gear.compliance, gear.gap) {
        (None, None) => {
            notes.push(format!(
                "joint {} is driven through a stiff spring ({STIFF_HZ} Hz), which measures the load for its friction",
                joint + 1
            ));
        }
        _ => notes.push(format!(
            "in the diagnosed model the motor of joint {name} is the body \"{name}.rotor\": the logged position is assumed to be measured \
                at the motor, before the gear"
        )),
    }
    at
}

fn free_name(model: &Model, wanted: &str) -> String {
    let taken = |name: &str| model.elements.iter().any(|e| e.name == name);
    let others = (2..).map(|i| format!("{wanted}_{i}"));
    std::iter::once(wanted.to_string()).chain(others).find(|name| !taken(name)).unwrap_or_default()
}
