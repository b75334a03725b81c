//! What a joint of a robot is where a target knows inertia, viscous and dry friction of a joint, and nothing else.

use crate::left_out::{Change, LeftOut, Part};
use backdrive_plant::elements::{Coulomb, Damper, Law, Stribeck};
use backdrive_plant::model::{InputKind, Model};
use backdrive_plant::robot::Arm;

/// What a target knows of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Knows {
    /// Its name in sentences.
    pub target: &'static str,
    /// Inertia that only moves with the coordinate.
    pub armature: bool,
    /// A level of dry friction for rest beside that for motion.
    pub rest: bool,
}

/// A joint in the few parameters that most programs have for it, N m, rad and s, or N, m and s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct JointTerms {
    /// kg m² or kg.
    pub armature: f64,
    /// N m s/rad or N s/m.
    pub damping: f64,
    /// Dry friction in motion, N m or N.
    pub friction: f64,
    /// Dry friction at rest, at least that in motion.
    pub at_rest: f64,
    /// Largest force of its motors; infinite where there is no limit.
    pub effort: f64,
}

/// Speed within which friction falls where a target has two levels and nothing between them, as a share of the law's own.
const AT_ONCE: f64 = 1e-3;

/// The joints of a robot, by coordinate of its tree, and what they are not.
pub(crate) fn joint_terms(model: &Model, arm: &Arm, knows: Knows) -> (Vec<JointTerms>, Vec<LeftOut>) {
    let mut left_out = Vec::new();
    let mut joined = model.clone();
    let mut joins = vec![Vec::new(); model.bodies.len()];
    while let Some((body, into)) = next_to_join(&joined, arm, &joins) {
        let change = Change::Join(body, into);
        change.apply(&mut joined);
        let (name, joint) = (&model.bodies[body].name, &model.bodies[into].name);
        let why = format!("{} has no bodies besides the links", knows.target);
        left_out.push(
            LeftOut::key(Part::Body, name, "compliance", why, Some(change.clone()))
                .replaced_by(format!("rigidly on joint \"{joint}\", with its inertia and its friction")),
        );
        joins[into].push(change.clone());
        joins[body].push(change);
    }
    let coordinate = |body: usize| arm.bodies.iter().position(|b| *b == body);
    let mut terms: Vec<JointTerms> = vec![JointTerms { effort: f64::INFINITY, ..JointTerms::default() }; arm.tree.len()];
    for (index, element) in joined.elements.iter().enumerate() {
        let body = match element.between {
            [Some(body), None] | [None, Some(body)] => body,
            [None, None] => continue,
            [Some(_), Some(_)] => {
                left_out.push(LeftOut::element(model, index, format!("{} has nothing between two joints", knows.target), None));
                continue;
            }
        };
        let Some(joint) = coordinate(body).and_then(|c| terms.get_mut(c)) else {
            left_out.push(LeftOut::element(model, index, "its body hangs on no joint of the robot", None));
            continue;
        };
        take(joint, model, index, &element.law, knows, &mut left_out);
    }
    for (c, body) in arm.bodies.iter().enumerate() {
        let (Some(joint), Some(found)) = (terms.get_mut(c), joined.bodies.get(*body)) else { continue };
        let whole = found.inertia + std::mem::take(&mut joint.armature);
        if knows.armature {
            joint.armature = whole;
        } else if found.inertia > 0.0 {
            let mut left = LeftOut::key(Part::Body, &found.name, "armature", format!("{} has no inertia of a rotor", knows.target), None);
            left.changes = joins[*body].iter().cloned().chain([Change::Inertia(*body, 0.0)]).collect();
            left_out.push(left);
        }
    }
    signals(&joined, arm, &mut terms, knows, &mut left_out);
    (terms, left_out)
}

/// A body that is no joint and hangs on one by some element, and that joint.
fn next_to_join(model: &Model, arm: &Arm, joins: &[Vec<Change>]) -> Option<(usize, usize)> {
    let is_joint = |body: usize| arm.bodies.contains(&body);
    let is_done = |body: usize| joins.get(body).is_some_and(|j| j.iter().any(|c| matches!(c, Change::Join(b, _) if *b == body)));
    model.elements.iter().find_map(|element| match element.between {
        [Some(a), Some(b)] if is_joint(a) && !is_joint(b) && !is_done(b) => Some((b, a)),
        [Some(a), Some(b)] if is_joint(b) && !is_joint(a) && !is_done(a) => Some((a, b)),
        _ => None,
    })
}

/// Adds an element to a joint.
fn take(joint: &mut JointTerms, model: &Model, index: usize, law: &Law, knows: Knows, left_out: &mut Vec<LeftOut>) {
    let level = |level: f64, why: &str, what: &str| {
        let instead = (Law::Coulomb(Coulomb { force: level }), format!("Coulomb friction of {what}"));
        (level, level, LeftOut::element(model, index, why, Some(instead)))
    };
    let two = |coulomb: f64, at_rest: f64, velocity: f64, why: &str| match knows.rest {
        true => {
            let law = Law::Stribeck(Stribeck { coulomb, at_rest, velocity: AT_ONCE * velocity });
            let instead = (law, "its levels at rest and at speed, with nothing between them".to_owned());
            (coulomb, at_rest, LeftOut::element(model, index, why, Some(instead)))
        }
        false => level(coulomb, why, "its level at speed"),
    };
    let memory = "a joint remembers no path";
    let (friction, at_rest, left) = match law {
        Law::Damper(l) => {
            joint.damping += l.damping;
            return;
        }
        Law::Coulomb(l) => {
            joint.friction += l.force;
            joint.at_rest += l.force;
            return;
        }
        Law::Inerter(l) if knows.armature => {
            joint.armature += l.inertance;
            return;
        }
        Law::AsymmetricDamper(l) => {
            let damping = 0.5 * (l.positive + l.negative);
            joint.damping += damping;
            let instead = (Law::Damper(Damper { damping }), "a damper of the mean of both directions".to_owned());
            left_out.push(LeftOut::element(model, index, "dampers are alike in both directions", Some(instead)));
            return;
        }
        Law::AsymmetricCoulomb(l) => {
            level(0.5 * (l.positive + l.negative), "friction is alike in both directions", "the mean of both directions")
        }
        Law::Stribeck(l) => two(l.coulomb, l.at_rest, l.velocity, "friction does not fall with speed bit by bit"),
        Law::Lugre(l) => two(l.coulomb, l.at_rest, l.velocity, memory),
        Law::PreisachLugre(l) => two(l.coulomb, l.at_rest.max(l.coulomb), l.velocity, memory),
        Law::FrictionDeficit(l) => level(l.coulomb, "friction does not rise with speed", "its level at speed"),
        Law::LoadFriction(l) => level(l.force, "friction does not grow with the load", "its level without load"),
        Law::WarmFriction(l) => level(l.force, "friction does not fall as it warms", "its level when cold"),
        Law::Dahl(l) => level(l.coulomb, memory, "the level that it comes to"),
        Law::MaxwellSlip(l) => level(l.force.iter().sum(), memory, "the sum of its sliders"),
        other => {
            let why = format!("{} has no {} of a joint", knows.target, other.kind().name.replace('_', " "));
            left_out.push(LeftOut::element(model, index, why, None));
            return;
        }
    };
    joint.friction += friction;
    joint.at_rest += at_rest;
    left_out.push(left);
}

/// Motors: back-EMF is damping, the limit an effort; the rest is left out.
fn signals(joined: &Model, arm: &Arm, terms: &mut [JointTerms], knows: Knows, left_out: &mut Vec<LeftOut>) {
    for (index, input) in joined.inputs.iter().enumerate() {
        let joint = arm.bodies.iter().position(|b| *b == input.on).and_then(|c| terms.get_mut(c));
        if input.kind == InputKind::Motion {
            let why = format!("{} does not prescribe a motion", knows.target);
            left_out.push(LeftOut::key(Part::Input, &input.name, "motion", why, None));
            continue;
        }
        match joint {
            Some(joint) => {
                joint.damping += input.back_emf;
                joint.effort = joint.effort.min(input.saturation);
            }
            None if input.saturation.is_finite() => {
                let why = "its body hangs on no joint of the robot";
                left_out.push(LeftOut::key(Part::Input, &input.name, "saturation", why, Some(Change::NoSaturation(index))));
            }
            None => {}
        }
        if input.delay != 0.0 {
            let why = format!("{} has no delay of a motor", knows.target);
            left_out.push(LeftOut::key(Part::Input, &input.name, "delay", why, Some(Change::NoDelay(index))));
        }
        if input.bandwidth.is_finite() {
            let why = format!("{} has no lag of a motor", knows.target);
            left_out.push(LeftOut::key(Part::Input, &input.name, "bandwidth", why, Some(Change::NoLag(index))));
        }
    }
}
