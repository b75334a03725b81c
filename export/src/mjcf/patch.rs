//! An MJCF file with the present joints, and everything else unchanged.

use super::attributes::{Integration, of_joint};
use super::bodies::on_joint;
use super::layout::Layout;
use super::network::{Network, OnJoint};
use crate::ExportError;
use crate::xml::{Edits, number};
use backdrive_plant::model::Model;
use backdrive_plant::robot::{Joint, JointKind, Robot};
use roxmltree::{Document, Node};

/// Sections that go to the end of the file.
#[derive(Debug, Default)]
pub(super) struct Sections {
    pub bodies: String,
    /// All others, whole.
    pub others: String,
}

/// The robot's file with the joints of the network, and `sections` at its end. What had to be removed is reported in `notes`.
///
/// # Errors
/// Where the file is not the one that the robot was read from.
pub(super) fn patched(
    xml: &str,
    model: &Model,
    parts: (&Robot, &Layout, &Network),
    integration: Integration,
    sections: &Sections,
    notes: &mut Vec<String>,
) -> Result<String, ExportError> {
    let (robot, layout, network) = parts;
    let document = Document::parse(xml).map_err(ExportError::new)?;
    let root = document.root_element();
    let world: Vec<Node> = root.children().filter(|n| n.has_tag_name("worldbody")).collect();
    let joints: Vec<Node> = world.iter().flat_map(|section| joints(*section)).collect();
    let moving: Vec<(usize, &Joint)> = robot.joints.iter().enumerate().filter(|(_, j)| j.kind != JointKind::Fixed).collect();
    if joints.len() != moving.len() {
        return Err(ExportError::new("the robot's MJCF has other joints than the model; name its file again under [robot]"));
    }
    let angle = angle(root);
    let mut edits = Edits::default();
    for (node, (index, joint)) in joints.iter().zip(&moving) {
        if node.attribute("name").is_none() {
            edits.set(*node, "name", &joint.name);
        }
        let Some(body) = layout.in_robot.iter().position(|j| *j == Some(*index)) else { continue };
        let on = on_joint(layout, network, body);
        let angle = if joint.kind == JointKind::Revolute { angle } else { 1.0 };
        for (name, value) in of_joint(&on, angle, integration) {
            if !is_there(joint, &on, name) {
                edits.set(*node, name, &value);
            }
        }
    }
    for section in root.children().filter(|n| n.is_element()) {
        take_out(section, model, layout, &mut edits, notes);
    }
    if let Some(section) = world.last() {
        edits.append(*section, &sections.bodies);
    }
    let [x, y, z] = robot.gravity.into();
    let option = format!(
        "  <option timestep=\"{}\" integrator=\"{}\" gravity=\"{} {} {}\"/>\n",
        number(integration.step),
        integration.integrator,
        number(x),
        number(y),
        number(z)
    );
    edits.append(root, &format!("\n{option}{}", sections.others));
    Ok(edits.done(xml))
}

/// Whether the file has the same value already.
fn is_there(joint: &Joint, on: &OnJoint, attribute: &str) -> bool {
    let linear = |all: &[f64; 3], first: f64| *all == [first, 0.0, 0.0];
    match attribute {
        "armature" => on.armature == joint.armature,
        "damping" => linear(&on.damping, joint.damping),
        "frictionloss" => on.friction == joint.friction,
        "stiffness" => linear(&on.stiffness, joint.stiffness),
        "springref" => (on.rest - joint.rest).abs() < 1e-14,
        _ => false,
    }
}

/// Joints in the order in which a robot is read: those of a body, then those of the bodies in it.
fn joints<'a>(body: Node<'a, 'a>) -> Vec<Node<'a, 'a>> {
    let (mut own, mut inside) = (Vec::new(), Vec::new());
    let mut open: Vec<Node> = body.children().filter(Node::is_element).collect();
    open.reverse();
    while let Some(node) = open.pop() {
        match node.tag_name().name() {
            "joint" => own.push(node),
            "body" => inside.push(node),
            "frame" => {
                let mut held: Vec<Node> = node.children().filter(Node::is_element).collect();
                held.reverse();
                open.extend(held);
            }
            _ => {}
        }
    }
    own.extend(inside.into_iter().flat_map(joints));
    own
}

/// rad per unit of an angle in the file.
fn angle(root: Node) -> f64 {
    let said = root.children().filter(|n| n.has_tag_name("compiler")).filter_map(|n| n.attribute("angle")).next_back();
    if said == Some("radian") { 1.0 } else { 1f64.to_radians() }
}

/// What would contradict the model's own signals: its actuators, sensors of them, and key frames of another length.
fn take_out(section: Node, model: &Model, layout: &Layout, edits: &mut Edits, notes: &mut Vec<String>) {
    let name = section.tag_name().name();
    let mut say = |what: &str| {
        if !notes.iter().any(|note| note == what) {
            notes.push(what.to_owned());
        }
    };
    let more_bodies = layout.in_robot.iter().any(Option::is_none);
    match name {
        "actuator" if !model.inputs.is_empty() || !model.servos.is_empty() => {
            edits.remove(section);
            say("the actuators of the MJCF are replaced by the model's own");
        }
        "sensor" if !model.inputs.is_empty() || !model.servos.is_empty() || !model.outputs.is_empty() => {
            let of_ours = |sensor: &Node| sensor.attribute("name").is_some_and(|n| model.outputs.iter().any(|o| o.name == n));
            for sensor in section.children().filter(|n| n.attribute("actuator").is_some() || of_ours(n)) {
                edits.remove(sensor);
                say("sensors of the MJCF that read its actuators, or have the name of an output of the model, are removed");
            }
        }
        "keyframe" if more_bodies || !model.inputs.is_empty() || !model.servos.is_empty() => {
            edits.remove(section);
            say("the key frames of the MJCF are removed: the model has other inputs or more bodies");
        }
        _ => {}
    }
}
