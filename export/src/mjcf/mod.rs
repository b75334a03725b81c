//! MuJoCo 4.0. What is meant by each attribute: MuJoCo XML reference, <https://mujoco.readthedocs.io/en/4.0.0/XMLreference.html>.

mod attributes;
mod bodies;
mod integration;
mod layout;
mod network;
mod passive;
mod patch;
mod signals;

use crate::xml::{comment, escaped, number, numbers};
use crate::{ExportError, Exported, of_robot};
use attributes::{Integration, tendons};
use backdrive_plant::model::Model;
use backdrive_plant::robot::{Arm, JointKind, Robot};
use layout::Layout;
use network::{Network, network};
use patch::{Sections, patched};
use signals::{Signals, signals};
use std::collections::BTreeSet;

/// A model for MuJoCo. `step` is its time step, s; `None` for one that suits the model.
///
/// # Errors
/// Where nothing moves, or the model cannot be simulated.
pub fn export(model: &Model, step: Option<f64>) -> Result<Exported, ExportError> {
    if model.bodies.is_empty() {
        return Err(ExportError::new("it is the model of nothing: it has no bodies"));
    }
    let mut notes = of_robot(model)?;
    let layout = Layout::of(model);
    let (network, mut left_out) = network(model, &layout.pose, names_in(model, "tendon"));
    let integration = integration::integration(model, &layout, &network, step)?;
    let mut signals = signals(model, &network, &layout.names, integration, names_in(model, "actuator"));
    left_out.append(&mut signals.left_out);
    let text = match &model.arm {
        None => of_network(model, &layout, &network, &signals, integration),
        Some(arm) => of_arm(model, arm, &layout, &network, &signals, integration, &mut notes)?,
    };
    notes.extend(of_commands(model));
    Ok(Exported { text, left_out, notes })
}

/// Names in a section of the robot's own MJCF.
fn names_in(model: &Model, section: &str) -> BTreeSet<String> {
    let Some(document) = model.arm.as_ref().and_then(|arm| roxmltree::Document::parse(&arm.xml).ok()) else { return BTreeSet::new() };
    let sections = document.root_element().children().filter(|n| n.has_tag_name(section));
    sections.flat_map(|s| s.children()).filter_map(|n| n.attribute("name")).map(str::to_owned).collect()
}

/// What MuJoCo has of every model.
fn sections(network: &Network, signals: &Signals, layout: &Layout, integration: Integration) -> String {
    let mut all = String::new();
    let mut section = |name: &str, inside: &str| {
        if !inside.is_empty() {
            all += &format!("  <{name}>\n{inside}  </{name}>\n");
        }
    };
    section("tendon", &(tendons(network, &layout.names, integration) + &signals.tendons));
    section("actuator", &signals.actuators);
    section("sensor", &signals.sensors);
    all
}

fn head(model: &Model) -> String {
    let said = [&model.title, &model.source].into_iter().filter(|text| !text.is_empty());
    said.map(|text| format!("  <!-- {} -->\n", comment(text))).collect()
}

fn of_network(model: &Model, layout: &Layout, network: &Network, signals: &Signals, integration: Integration) -> String {
    format!(
        "<mujoco model=\"{}\">\n{}  <compiler angle=\"radian\"/>\n  <option timestep=\"{}\" integrator=\"{}\" gravity=\"0 0 0\"/>\n  <worldbody>\n{}  \
         </worldbody>\n{}</mujoco>\n",
        escaped(&model.name),
        head(model),
        number(integration.step),
        integration.integrator,
        bodies::of_network(layout, network, integration),
        sections(network, signals, layout, integration),
    )
}

fn of_arm(
    model: &Model,
    arm: &Arm,
    layout: &Layout,
    network: &Network,
    signals: &Signals,
    integration: Integration,
    notes: &mut Vec<String>,
) -> Result<String, ExportError> {
    let robot = &arm.robot;
    let is_mjcf = roxmltree::Document::parse(&arm.xml).is_ok_and(|d| d.root_element().has_tag_name("mujoco"));
    let mut taken: BTreeSet<String> = robot.links.iter().map(|link| link.name.clone()).collect();
    let beside = bodies::next_to_nothing(layout, network, integration, &mut taken);
    let mut others = sections(network, signals, layout, integration);
    if layout.is_posed(&robot.joints) {
        others += &pose(robot, layout);
        notes.push(
            "the arm's pose is the key frame \"pose\": begin there, and take it from a joint's sensor to have the model's position"
                .to_owned(),
        );
    }
    if is_mjcf {
        let of_file = arm.remarks.iter().filter(|remark| remark.matters);
        notes.extend(of_file.map(|remark| format!("MuJoCo may compute what this program does not: {remark}")));
        let sections = Sections { bodies: beside, others };
        return patched(&arm.xml, model, (robot, layout, network), integration, &sections, notes);
    }
    notes.push("what a URDF has besides links, joints and their inertia (meshes, collision shapes) is not in the MJCF".to_owned());
    notes.extend(doubts(robot));
    let massless =
        robot.joints.iter().filter(|j| j.kind != JointKind::Fixed).any(|j| robot.links.get(j.child).is_some_and(|l| l.inertia.is_none()));
    // A link of no mass that moves: MuJoCo wants some.
    let bound = if massless { " boundmass=\"1e-9\" boundinertia=\"1e-12\"" } else { "" };
    Ok(format!(
        "<mujoco model=\"{}\">\n{}  <compiler angle=\"radian\"{bound}/>\n  <option timestep=\"{}\" integrator=\"{}\" gravity=\"{}\"/>\n  <worldbody>\n{}{beside}  \
         </worldbody>\n{others}</mujoco>\n",
        escaped(if model.name.is_empty() { &robot.name } else { &model.name }),
        head(model),
        number(integration.step),
        integration.integrator,
        numbers(robot.gravity.as_slice()),
        bodies::of_robot(robot, layout, network, integration),
    ))
}

/// A key frame in which every position of the model is 0: coordinates in the order in which MuJoCo has the joints.
fn pose(robot: &Robot, layout: &Layout) -> String {
    let mut order: Vec<usize> = Vec::new();
    follow(robot, 0, &mut order);
    let of_robot = order.iter().filter_map(|joint| layout.in_robot.iter().position(|j| *j == Some(*joint)));
    let beside = (0..layout.names.len()).filter(|body| layout.in_robot[*body].is_none());
    let all: Vec<f64> = of_robot.chain(beside).map(|body| layout.pose[body]).collect();
    format!("  <keyframe>\n    <key name=\"pose\" qpos=\"{}\"/>\n  </keyframe>\n", numbers(&all))
}

/// Moving joints, each before those that it carries.
fn follow(robot: &Robot, link: usize, order: &mut Vec<usize>) {
    for (index, joint) in robot.joints.iter().enumerate().filter(|(_, joint)| joint.parent == link) {
        if joint.kind != JointKind::Fixed {
            order.push(index);
        }
        follow(robot, joint.child, order);
    }
}

fn doubts(robot: &Robot) -> impl Iterator<Item = String> + '_ {
    let doubt = |link: &backdrive_plant::robot::Link| {
        link.doubt()
            .map(|doubt| format!("link \"{}\" {doubt}; MuJoCo refuses it unless the compiler has balanceinertia=\"true\"", link.name))
    };
    robot.links.iter().filter_map(doubt)
}

fn of_commands(model: &Model) -> Option<String> {
    let limited: Vec<&str> = model.axes.iter().filter(|a| a.force.is_some()).map(|a| a.name.as_str()).collect();
    (!limited.is_empty()).then(|| {
        format!("the commands of axis {} are limited to what its motor gives; `backdrive simulate` does not limit them", limited.join(", "))
    })
}
