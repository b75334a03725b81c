//! The text of a whole MJCF file.

use super::attributes::{Integration, is_mjcf, tendons};
use super::bodies;
use super::layout::Layout;
use super::network::Network;
use super::patch::{Sections, patched};
use super::signals::Signals;
use crate::ExportError;
use crate::left_out::{LeftOut, Part};
use crate::xml::{comment, escaped, number, numbers};
use backdrive_plant::model::Model;
use backdrive_plant::robot::{Arm, JointKind, Robot};
use std::collections::BTreeSet;

/// Names in a section of the robot's own MJCF.
pub(super) fn names_in(model: &Model, section: &str) -> BTreeSet<String> {
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

/// Title and source of a model as comments.
pub(super) fn head(model: &Model) -> String {
    let said = [&model.title, &model.source].into_iter().filter(|text| !text.is_empty());
    said.map(|text| format!("  <!-- {} -->\n", comment(text))).collect()
}

/// A model without a robot.
pub(super) fn of_network(model: &Model, layout: &Layout, network: &Network, signals: &Signals, integration: Integration) -> String {
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

/// A model with a robot.
///
/// # Errors
/// Where the robot's own MJCF is not the one that it was read from.
pub(super) fn of_arm(
    model: &Model,
    arm: &Arm,
    layout: &Layout,
    network: &Network,
    signals: &Signals,
    integration: Integration,
    (notes, left_out): (&mut Vec<String>, &mut Vec<LeftOut>),
) -> Result<String, ExportError> {
    let robot = &arm.robot;
    let is_mjcf = is_mjcf(arm);
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
    left_out.extend(of_urdf(arm));
    left_out.extend(bodies::impossible(robot));
    let bodies = bodies::of_robot(robot, layout, network, integration, notes);
    Ok(format!(
        "<mujoco model=\"{}\">\n{}  <compiler angle=\"radian\"/>\n  <option timestep=\"{}\" integrator=\"{}\" gravity=\"{}\"/>\n  <worldbody>\n{bodies}{beside}  \
         </worldbody>\n{others}</mujoco>\n",
        escaped(if model.name.is_empty() { &robot.name } else { &model.name }),
        head(model),
        number(integration.step),
        integration.integrator,
        numbers(robot.gravity.as_slice()),
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

/// What a URDF has besides links, joints and their inertia, and an MJCF written from these does not.
fn of_urdf(arm: &Arm) -> Vec<LeftOut> {
    let why = "the MJCF is written from links, joints and their inertia";
    let times = |times: usize| if times == 1 { "once".to_owned() } else { format!("{times} times") };
    let of_file = arm.remarks.iter().filter(|remark| remark.about.starts_with('<') && remark.about != "<limit>");
    let mut out: Vec<LeftOut> = of_file.map(|remark| LeftOut::key(Part::Robot, &remark.about, &times(remark.times), why, None)).collect();
    let moving = arm.robot.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
    let of_speed: Vec<&str> = moving.clone().filter(|joint| joint.limits.velocity.is_some()).map(|joint| joint.name.as_str()).collect();
    if !of_speed.is_empty() {
        let name = format!("largest speed of {}", of_speed.join(", "));
        out.push(LeftOut::key(Part::Robot, &name, "velocity", "MuJoCo has no limit of a joint's speed", None));
    }
    let locked: Vec<&str> =
        moving.filter(|joint| joint.limits.range.is_some_and(|[low, high]| low >= high)).map(|joint| joint.name.as_str()).collect();
    if !locked.is_empty() {
        let name = format!("range of {}", locked.join(", "));
        out.push(LeftOut::key(Part::Robot, &name, "limit", "its ends are the same, and MuJoCo wants a range of some width", None));
    }
    out
}
