//! Attributes of joints and tendons as text.

use super::network::{Network, OnJoint, Tendon};
use super::passive::NEVER;
use crate::xml::{escaped, number, numbers};
use backdrive_plant::robot::Arm;

/// How MuJoCo is to integrate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Integration {
    /// s.
    pub step: f64,
    /// `RK4` or `implicitfast`.
    pub integrator: &'static str,
}

impl Integration {
    /// Attributes that hold dry friction as close to set-valued as MuJoCo's constraints allow. A sticking joint of mass m that holds a force f creeps with
    /// about f (1 - d)/d T/(2 m). The impedance d is at most 0.9999, and the time constant T at least two steps.
    pub(super) fn friction(self) -> [(&'static str, String); 2] {
        [("solreffriction", format!("{} 1", number(2.0 * self.step))), ("solimpfriction", "0.9999 0.9999 0.001 0.5 2".to_owned())]
    }
}

/// Coefficients without the zeros at their end.
fn coefficients(all: &[f64; 3]) -> String {
    let last = all.iter().rposition(|c| *c != 0.0).unwrap_or(0);
    numbers(&all[..=last])
}

/// Attributes of a joint, all of them, so that no default of the file counts. `angle`: what the file counts angles in, rad.
pub(super) fn of_joint(joint: &OnJoint, angle: f64, integration: Integration) -> Vec<(&'static str, String)> {
    let mut all = vec![
        ("armature", number(joint.armature)),
        ("damping", coefficients(&joint.damping)),
        ("frictionloss", number(joint.friction)),
        ("stiffness", coefficients(&joint.stiffness)),
    ];
    if joint.stiffness != [0.0; 3] {
        all.push(("springref", number(joint.rest / angle)));
    }
    if joint.friction > 0.0 {
        all.extend(integration.friction());
    }
    all
}

/// Attributes as text, each with a space before it. Whether an arm's file is an MJCF, which is patched; a new URDF is written.
pub(super) fn is_mjcf(arm: &Arm) -> bool {
    roxmltree::Document::parse(&arm.xml).is_ok_and(|d| d.root_element().has_tag_name("mujoco"))
}

pub(super) fn text(attributes: &[(&'static str, String)]) -> String {
    attributes.iter().map(|(name, value)| format!(" {name}=\"{value}\"")).collect()
}

/// `<fixed>` elements, by the names of the joints.
pub(super) fn tendons(network: &Network, joints: &[String], integration: Integration) -> String {
    let one = |tendon: &Tendon| {
        let p = &tendon.passive;
        let mut all = vec![("stiffness", coefficients(&p.stiffness))];
        if p.has_spring() {
            all.push(("springlength", numbers(&p.slack.map(length))));
        }
        if p.yields > 0.0 {
            all.push(("springyield", number(p.yields)));
        }
        all.push(("damping", coefficients(&p.damping)));
        all.push(("frictionloss", number(p.friction)));
        if p.friction > 0.0 {
            all.extend(integration.friction());
        }
        if p.inertia > 0.0 {
            all.push(("armature", number(p.inertia)));
        }
        format!("    <fixed name=\"{}\"{}>{}</fixed>\n", escaped(&tendon.name), text(&all), ends(&tendon.ends, joints))
    };
    network.tendons.iter().map(one).collect()
}

/// `<joint>` elements of a fixed tendon.
pub(super) fn ends(ends: &[(usize, f64)], joints: &[String]) -> String {
    let one = |(body, factor): &(usize, f64)| {
        joints.get(*body).map(|joint| format!("<joint joint=\"{}\" coef=\"{}\"/>", escaped(joint), number(*factor)))
    };
    ends.iter().filter_map(one).collect()
}

/// A length of a tendon: that of -1 means another to MuJoCo, and the ends of a dead band stay where they are.
fn length(x: f64) -> f64 {
    match x {
        -1.0 => -1.0 - 1e-12,
        _ if x.abs() > 0.5 * NEVER => NEVER.copysign(x),
        _ => x,
    }
}
