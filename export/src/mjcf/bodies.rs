//! Bodies as text: those of a network beside each other, those of a robot in each other.

use super::attributes::{Integration, of_joint, text};
use super::layout::Layout;
use super::network::{Network, OnJoint};
use crate::names::unlike;
use crate::xml::{escaped, number, numbers};
use backdrive_plant::robot::{Joint, JointKind, LinkInertia, Placement, Robot};
use nalgebra::{Rotation3, UnitQuaternion};
use std::collections::BTreeSet;

/// Mass of a body whose inertia is its joint's armature, as a share of the least of these: MuJoCo wants one that is not 0.
const NEXT_TO_NOTHING: f64 = 1e-9;
/// What a principal moment is raised to, as a share of the largest: MuJoCo wants all of them above 0, and none above the sum of the others.
const THIN: f64 = 1e-9;

/// What hangs on a body's joint.
pub(super) fn on_joint(layout: &Layout, network: &Network, body: usize) -> OnJoint {
    network.joints.get(body).copied().unwrap_or_default().at(layout, body)
}

impl OnJoint {
    /// With the inertia that the body itself has, where that is no link's, and the robot's armature.
    fn at(mut self, layout: &Layout, body: usize) -> OnJoint {
        if layout.in_robot.get(body).is_some_and(Option::is_some) {
            self.armature += layout.inertia.get(body).copied().unwrap_or(0.0);
        }
        self
    }
}

/// Bodies of a model without a robot: each on a joint of its own in the world, so that its coordinate is its position.
pub(super) fn of_network(layout: &Layout, network: &Network, integration: Integration) -> String {
    if network.is_nested() {
        return next_to_nothing(layout, network, integration, &mut BTreeSet::new());
    }
    let mut all = String::new();
    for (body, name) in layout.names.iter().enumerate() {
        let joint = on_joint(layout, network, body);
        let mass = layout.inertia[body].max(1e-12);
        let kind = word(layout.kinds[body]);
        let name = escaped(name);
        let range = range(layout.travel[body]);
        all += &format!(
            "    <body name=\"{name}\" pos=\"0 {} 0\">\n      <joint name=\"{name}\" type=\"{kind}\" axis=\"1 0 0\"{}{range}/>\n      \
             <inertial pos=\"0 0 0\" mass=\"{m}\" diaginertia=\"{m} {m} {m}\"/>\n      \
             <geom type=\"box\" size=\"0.02 0.02 0.02\" contype=\"0\" conaffinity=\"0\" mass=\"0\"/>\n    </body>\n",
            number(0.1 * body as f64),
            text(&of_joint(&joint, 1.0, integration)),
            m = number(mass),
        );
    }
    all
}

/// Bodies of the network that are none of the robot's joints, such as rotors behind soft gears: their inertia is their joint's armature, so that no gravity acts
/// on them. Where inertia acts between two of them they stand in each other: without mass none moves what is in it, and MuJoCo's mass matrix has a place for
/// that inertia. `taken`: names of other bodies.
pub(super) fn next_to_nothing(layout: &Layout, network: &Network, integration: Integration, taken: &mut BTreeSet<String>) -> String {
    let bodies = || layout.inertia.iter().enumerate().filter(|(body, _)| layout.in_robot[*body].is_none());
    let least = bodies().map(|(_, inertia)| *inertia).filter(|inertia| *inertia > 0.0).fold(1.0, f64::min);
    let m = number(NEXT_TO_NOTHING * least);
    let (mut all, mut closed) = (String::new(), String::new());
    for (body, inertia) in bodies() {
        let name = &layout.names[body];
        let mut joint = on_joint(layout, network, body);
        joint.armature += inertia;
        let range = layout.travel[body].map_or(" limited=\"false\"".to_owned(), |travel| range(Some(travel)));
        all += &format!(
            "    <body name=\"{}\">\n      <joint name=\"{}\" type=\"{}\" axis=\"1 0 0\" ref=\"0\"{}{range}/>\n      \
             <inertial pos=\"0 0 0\" mass=\"{m}\" diaginertia=\"{m} {m} {m}\"/>\n      \
             <geom type=\"sphere\" size=\"0.001\" contype=\"0\" conaffinity=\"0\" mass=\"{m}\"/>\n",
            escaped(&unlike(name.clone(), taken)),
            escaped(name),
            word(layout.kinds[body]),
            text(&of_joint(&joint, 1.0, integration)),
        );
        let end = "    </body>\n";
        if network.is_nested() { closed += end } else { all += end }
    }
    all + &closed
}

/// The bodies of a robot, from its description.
pub(super) fn of_robot(robot: &Robot, layout: &Layout, network: &Network, integration: Integration) -> String {
    let writer = Writer { robot, layout, network, integration };
    let mut out = String::new();
    match robot.links.first() {
        Some(base) => {
            out += &format!("    <body name=\"{}\">\n", escaped(&base.name));
            base.inertia.iter().for_each(|inertia| out += &inertial(inertia, 3));
            writer.children(0, 3, &mut out);
            out += "    </body>\n";
        }
        None => debug_assert!(false, "a robot has a base"),
    }
    out
}

struct Writer<'a> {
    robot: &'a Robot,
    layout: &'a Layout,
    network: &'a Network,
    integration: Integration,
}

impl Writer<'_> {
    fn children(&self, link: usize, depth: usize, out: &mut String) {
        for (index, joint) in self.robot.joints.iter().enumerate().filter(|(_, joint)| joint.parent == link) {
            let Some(child) = self.robot.links.get(joint.child) else { continue };
            let indent = "  ".repeat(depth);
            *out += &format!("{indent}<body name=\"{}\"{}>\n", escaped(&child.name), place(&joint.origin));
            if joint.kind != JointKind::Fixed {
                *out += &format!("{indent}  {}\n", self.joint(index, joint));
            }
            child.inertia.iter().for_each(|inertia| *out += &inertial(inertia, depth + 1));
            self.children(joint.child, depth + 1, out);
            *out += &format!("{indent}</body>\n");
        }
    }

    fn joint(&self, index: usize, joint: &Joint) -> String {
        let body = self.layout.in_robot.iter().position(|j| *j == Some(index));
        let on = body.map_or_else(OnJoint::default, |body| on_joint(self.layout, self.network, body));
        let mut text = format!(
            "<joint name=\"{}\" type=\"{}\" axis=\"{}\"{}",
            escaped(&joint.name),
            word(joint.kind),
            numbers(joint.axis.as_slice()),
            text(&of_joint(&on, 1.0, self.integration)),
        );
        if joint.reference != 0.0 {
            text += &format!(" ref=\"{}\"", number(joint.reference));
        }
        text += &range(joint.limits.range);
        if let Some(effort) = joint.limits.effort.filter(|effort| *effort > 0.0 && effort.is_finite()) {
            text += &format!(" actuatorfrcrange=\"{} {}\"", number(-effort), number(effort));
        }
        text + "/>"
    }
}

/// How MuJoCo calls a joint of this kind.
fn word(kind: JointKind) -> &'static str {
    if kind == JointKind::Revolute { "hinge" } else { "slide" }
}

/// Limits of motion.
fn range(range: Option<[f64; 2]>) -> String {
    range.filter(|[low, high]| low < high).map_or(String::new(), |r| format!(" limited=\"true\" range=\"{}\"", numbers(&r)))
}

fn place(at: &Placement) -> String {
    let mut text = String::new();
    if at.translation.iter().any(|x| *x != 0.0) {
        text += &format!(" pos=\"{}\"", numbers(at.translation.as_slice()));
    }
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(at.rotation));
    if turn.imag().norm() > 1e-15 {
        text += &format!(" quat=\"{}\"", numbers(&[turn.w, turn.i, turn.j, turn.k]));
    }
    text
}

fn inertial(of: &LinkInertia, depth: usize) -> String {
    let mut moments: [f64; 3] = of.about_centre.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    let least = THIN * moments[2].abs().max(1e-6 * of.mass);
    let raised = if moments[0] < least || moments[0] + moments[1] < moments[2] + least { least } else { 0.0 };
    let m = of.about_centre;
    format!(
        "{}<inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{}\"/>\n",
        "  ".repeat(depth),
        numbers(of.centre.as_slice()),
        number(of.mass),
        numbers(&[m[(0, 0)] + raised, m[(1, 1)] + raised, m[(2, 2)] + raised, m[(0, 1)], m[(0, 2)], m[(1, 2)]])
    )
}
