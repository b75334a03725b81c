//! A network's elements as what MuJoCo has on joints, as tendons and as constant forces.
//!
//! Every body of the network is a joint whose coordinate is the body's position. An element between a body and ground is therefore the joint's, and one
//! between two bodies is a fixed tendon whose length is the difference of two coordinates.

use super::passive::{Passive, exactly, nearest};
use crate::left_out::LeftOut;
use crate::names::unlike;
use backdrive_plant::elements::Law;
use backdrive_plant::model::{InputKind, Model};
use std::collections::BTreeSet;

/// What hangs on one joint besides its links.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct OnJoint {
    /// kg or kg m².
    pub armature: f64,
    /// Of `v`, `v |v|` and `v³`.
    pub damping: [f64; 3],
    /// N or N m.
    pub friction: f64,
    /// Of the displacement from `rest`, its square and its cube.
    pub stiffness: [f64; 3],
    /// Coordinate at which the spring is slack, m or rad.
    pub rest: f64,
}

/// A combination of coordinates: indices of bodies, each with its factor.
pub(super) type Ends = Vec<(usize, f64)>;

/// What acts along a combination of coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tendon {
    pub name: String,
    pub ends: Ends,
    /// `slack` is that of the tendon's length.
    pub passive: Passive,
}

/// A constant force along a combination of coordinates, N or N m.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Constant {
    pub name: String,
    pub ends: Ends,
    pub force: f64,
}

/// The network.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Network {
    /// By body.
    pub joints: Vec<OnJoint>,
    pub tendons: Vec<Tendon>,
    pub constants: Vec<Constant>,
    /// Names that are taken among tendons.
    names: BTreeSet<String>,
}

/// The network of a model whose bodies have their zero at the coordinates `pose`, and what is not in it. `names`: of tendons that are there already.
pub(super) fn network(model: &Model, pose: &[f64], names: BTreeSet<String>) -> (Network, Vec<LeftOut>) {
    let mut network = Network { joints: vec![OnJoint::default(); model.bodies.len()], names, ..Network::default() };
    let mut left_out = Vec::new();
    for (index, element) in model.elements.iter().enumerate() {
        let ends: Ends = match element.between {
            [Some(a), Some(b)] => vec![(a, 1.0), (b, -1.0)],
            [Some(a), None] => vec![(a, 1.0)],
            [None, Some(b)] => vec![(b, -1.0)],
            [None, None] => continue,
        };
        if matches!(element.law, Law::Inerter(_)) && !is_one_tree(model, &ends) {
            let why = "MuJoCo leaves out a tendon's inertia between joints of which none carries the other";
            left_out.push(LeftOut::element(model, index, why, None));
            continue;
        }
        for passive in parts(model, index, &element.law, &mut left_out) {
            network.add(&element.name, &ends, passive, pose);
        }
    }
    for input in model.inputs.iter().filter(|i| i.kind == InputKind::Force && i.back_emf != 0.0) {
        // It is equivalent to a damper.
        if let Some(joint) = network.joints.get_mut(input.on) {
            joint.damping[0] += input.back_emf;
        }
    }
    (network, left_out)
}

/// Whether MuJoCo has an inertia along these ends: its mass matrix is empty between joints of which none carries the other. Bodies of the network alone are put
/// into each other for it, see [`Network::is_nested`].
fn is_one_tree(model: &Model, ends: &Ends) -> bool {
    let &[(a, _), (b, _)] = ends.as_slice() else { return true };
    let Some(arm) = &model.arm else { return true };
    let joint =
        |body: usize| arm.bodies.iter().position(|other| *other == body).and_then(|c| arm.tree.coordinates().get(c)).map(|c| c.joint);
    let carries = |outer: usize, inner: usize| {
        let mut at = arm.robot.joints.get(inner).map(|j| j.parent);
        while let Some(link) = at {
            match arm.robot.joints.iter().position(|j| j.child == link) {
                Some(joint) if joint == outer => return true,
                carrier => at = carrier.map(|joint| arm.robot.joints[joint].parent),
            }
        }
        false
    };
    match (joint(a), joint(b)) {
        (None, None) => true,
        (Some(a), Some(b)) => carries(a, b) || carries(b, a),
        _ => false,
    }
}

/// An element's law, or what is nearest to it.
fn parts(model: &Model, index: usize, law: &Law, left_out: &mut Vec<LeftOut>) -> Vec<Passive> {
    if let Some(parts) = exactly(law) {
        return parts;
    }
    let (why, instead) = nearest(law);
    let parts = instead.as_ref().and_then(|(law, _)| exactly(law)).unwrap_or_default();
    left_out.push(LeftOut::element(model, index, why, instead));
    parts
}

impl Network {
    /// Whether bodies of the network alone have to stand in each other, so that an inertia between two of them counts.
    pub(super) fn is_nested(&self) -> bool {
        self.tendons.iter().any(|tendon| tendon.passive.inertia > 0.0)
    }

    fn add(&mut self, name: &str, ends: &Ends, mut passive: Passive, pose: &[f64]) {
        if passive.constant != 0.0 {
            let name = unlike(name.to_owned(), &mut self.names);
            self.constants.push(Constant { name, ends: ends.clone(), force: -passive.constant });
            passive.constant = 0.0;
        }
        if let &[(body, sign)] = ends.as_slice() {
            let at = pose.get(body).copied().unwrap_or(0.0);
            self.joint(body).take(&mut passive, sign, at);
        }
        if !passive.has_spring() {
            passive.slack = [0.0; 2];
        }
        if passive == Passive::default() {
            return;
        }
        let at_pose: f64 = ends.iter().map(|(body, factor)| factor * pose.get(*body).copied().unwrap_or(0.0)).sum();
        passive.slack = passive.slack.map(|x| x + at_pose);
        let same = |tendon: &&mut Tendon| tendon.ends == *ends && tendon.passive.is_apart_from(&passive);
        match self.tendons.iter_mut().find(same) {
            Some(tendon) => tendon.passive.join(&passive),
            None => {
                let name = unlike(name.to_owned(), &mut self.names);
                self.tendons.push(Tendon { name, ends: ends.clone(), passive });
            }
        }
    }

    fn joint(&mut self, body: usize) -> &mut OnJoint {
        if self.joints.len() <= body {
            self.joints.resize(body + 1, OnJoint::default());
        }
        &mut self.joints[body]
    }
}

impl OnJoint {
    /// Takes over what a joint can have; `sign` is the factor of its coordinate in the element's displacement, `at` the coordinate where that is 0.
    fn take(&mut self, passive: &mut Passive, sign: f64, at: f64) {
        self.armature += std::mem::take(&mut passive.inertia);
        self.friction += std::mem::take(&mut passive.friction);
        for (sum, more) in self.damping.iter_mut().zip(std::mem::take(&mut passive.damping)) {
            *sum += more;
        }
        if !passive.fits_a_joint() || !passive.has_spring() {
            return;
        }
        let [a, b, c] = passive.stiffness;
        let (own, rest) = ([a, sign * b, c], at + sign * passive.slack[0]);
        let is_linear = |k: &[f64; 3]| k[1] == 0.0 && k[2] == 0.0;
        if self.stiffness == [0.0; 3] {
            (self.stiffness, self.rest) = (own, rest);
        } else if rest == self.rest {
            self.stiffness.iter_mut().zip(own).for_each(|(sum, more)| *sum += more);
        } else if is_linear(&own) && is_linear(&self.stiffness) && self.stiffness[0] + a != 0.0 {
            let sum = self.stiffness[0] + a;
            (self.stiffness[0], self.rest) = (sum, (self.stiffness[0] * self.rest + a * rest) / sum);
        } else {
            return;
        }
        passive.stiffness = [0.0; 3];
    }
}

impl Passive {
    /// Whether one tendon can have both: at most one has a spring.
    fn is_apart_from(&self, other: &Passive) -> bool {
        !(self.has_spring() && other.has_spring())
    }

    fn join(&mut self, other: &Passive) {
        if other.has_spring() {
            (self.stiffness, self.slack, self.yields) = (other.stiffness, other.slack, other.yields);
        }
        self.damping.iter_mut().zip(other.damping).for_each(|(sum, more)| *sum += more);
        self.friction += other.friction;
        self.inertia += other.inertia;
    }
}
