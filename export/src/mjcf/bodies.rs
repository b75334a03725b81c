//! Bodies as text: those of a network beside each other, those of a robot in each other.

use super::attributes::{Integration, of_joint, text};
use super::layout::Layout;
use super::network::{Network, OnJoint};
use crate::left_out::{Change, LeftOut, Part};
use crate::names::unlike;
use crate::xml::{escaped, number, numbers};
use backdrive_plant::robot::{Joint, JointKind, Link, LinkInertia, Placement, Robot};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use std::collections::BTreeSet;

/// Mass of a body whose inertia is its joint's armature, as a share of the least of these: MuJoCo wants one that is not 0.
const NEXT_TO_NOTHING: f64 = 1e-9;
/// What a principal moment is raised to, as a share of the largest: MuJoCo wants all of them above 0, and none above the sum of the others.
const THIN: f64 = 1e-9;
/// The least principal moment that MuJoCo reads from a whole matrix is 1e-14 kg m².
const LEAST_MOMENT: f64 = 2e-14;
/// Mass, kg, and inertia, kg m², of a link that moves and has none: MuJoCo wants some.
const NO_MASS: [f64; 2] = [1e-9, 1e-12];
/// MuJoCo's name for what does not move, which no other body may have.
const WORLD: &str = "world";

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

/// The bodies of a robot, from its description. A base of the name `world` is MuJoCo's own; other necessary changes are reported in `notes`.
pub(super) fn of_robot(robot: &Robot, layout: &Layout, network: &Network, integration: Integration, notes: &mut Vec<String>) -> String {
    let mut taken: BTreeSet<String> = robot.links.iter().map(|link| link.name.clone()).chain([WORLD.to_owned()]).collect();
    let mut named = |link: &Link| if link.name == WORLD { unlike(WORLD.to_owned(), &mut taken) } else { link.name.clone() };
    let names: Vec<String> = robot.links.iter().enumerate().map(|(i, link)| if i == 0 { link.name.clone() } else { named(link) }).collect();
    for (link, name) in robot.links.iter().zip(&names).filter(|(link, name)| link.name != **name) {
        notes.push(format!("link \"{}\" is body \"{name}\" in the MJCF, where that name is the world's", link.name));
    }
    let writer = Writer { robot, layout, network, integration, names };
    let mut out = String::new();
    match robot.links.first() {
        Some(base) if base.name == WORLD => {
            notes.push("the base is called \"world\", a name reserved by MuJoCo: its children are written into <worldbody>".to_owned());
            writer.children(0, 2, &mut out);
        }
        Some(base) => {
            out += &format!("    <body name=\"{}\">\n", escaped(&base.name));
            weight(base).iter().for_each(|inertia| out += &inertial(inertia, 3));
            writer.children(0, 3, &mut out);
            out += "    </body>\n";
        }
        None => debug_assert!(false, "a robot has a base"),
    }
    let light: Vec<&str> = writer.massless().filter_map(|link| robot.links.get(link)).map(|link| link.name.as_str()).collect();
    if !light.is_empty() {
        notes.push(format!("MuJoCo wants a mass of what moves: {} has {} kg", light.join(", "), number(NO_MASS[0])));
    }
    out
}

/// The inertia of a link that has any.
fn weight(link: &Link) -> Option<&LinkInertia> {
    link.inertia.as_ref().filter(|of| of.mass > 0.0 || of.about_centre.amax() > 0.0)
}

/// Links whose moments of inertia no body can have, and MuJoCo refuses: what they are raised to.
pub(super) fn impossible(robot: &Robot) -> Vec<LeftOut> {
    let one = |(index, link): (usize, &Link)| {
        let doubt = link.doubt()?;
        let of = weight(link)?;
        let raised = of.about_centre + Matrix3::identity() * missing(of);
        let instead = format!("the same and {} kg m² about every axis", number(missing(of)));
        let left = LeftOut::key(Part::Robot, &link.name, "inertia", doubt, Some(Change::LinkInertia(index, raised)));
        Some(left.replaced_by(instead))
    };
    robot.links.iter().enumerate().filter_map(one).collect()
}

struct Writer<'a> {
    robot: &'a Robot,
    layout: &'a Layout,
    network: &'a Network,
    integration: Integration,
    /// Names of the bodies, by link.
    names: Vec<String>,
}

impl Writer<'_> {
    fn children(&self, link: usize, depth: usize, out: &mut String) {
        for (index, joint) in self.robot.joints.iter().enumerate().filter(|(_, joint)| joint.parent == link) {
            let (Some(child), Some(name)) = (self.robot.links.get(joint.child), self.names.get(joint.child)) else { continue };
            let indent = "  ".repeat(depth);
            *out += &format!("{indent}<body name=\"{}\"{}>\n", escaped(name), place(&joint.origin));
            if joint.kind != JointKind::Fixed {
                *out += &format!("{indent}  {}\n", self.joint(index, joint));
            }
            match weight(child) {
                Some(inertia) => {
                    // A moving body may not have moments without a mass.
                    let least = if joint.kind == JointKind::Fixed { 0.0 } else { NO_MASS[0] };
                    *out += &inertial(&LinkInertia { mass: inertia.mass.max(least), ..*inertia }, depth + 1);
                }
                None if joint.kind != JointKind::Fixed && !self.carries_mass(joint.child) => {
                    let [mass, moment] = NO_MASS.map(number);
                    let moments = format!("{moment} {moment} {moment}");
                    *out += &format!("{indent}  <inertial pos=\"0 0 0\" mass=\"{mass}\" diaginertia=\"{moments}\"/>\n");
                }
                None => {}
            }
            self.children(joint.child, depth + 1, out);
            *out += &format!("{indent}</body>\n");
        }
    }

    /// Links that move and have no mass, nor carry any that is fixed to them.
    fn massless(&self) -> impl Iterator<Item = usize> + '_ {
        let moving = self.robot.joints.iter().filter(|joint| joint.kind != JointKind::Fixed).map(|joint| joint.child);
        moving.filter(|link| {
            self.robot.links.get(*link).is_some_and(|own| own.inertia.is_none_or(|of| of.mass == 0.0) && !self.carries_mass(*link))
        })
    }

    /// Whether something that is fixed to a link has mass.
    fn carries_mass(&self, link: usize) -> bool {
        let fixed = self.robot.joints.iter().filter(|joint| joint.parent == link && joint.kind == JointKind::Fixed);
        fixed.map(|joint| joint.child).any(|child| {
            self.robot.links.get(child).is_some_and(|own| own.inertia.is_some_and(|of| of.mass > 0.0)) || self.carries_mass(child)
        })
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

/// By how much the principal moments have to be raised for MuJoCo to read them, kg m².
fn missing(of: &LinkInertia) -> f64 {
    let mut moments: [f64; 3] = of.about_centre.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    let least = (THIN * moments[2].abs().max(1e-6 * of.mass)).max(LEAST_MOMENT);
    (least - moments[0]).max(moments[2] - moments[1] - moments[0] + least).max(0.0)
}

fn inertial(of: &LinkInertia, depth: usize) -> String {
    let raised = missing(of);
    let m = of.about_centre;
    format!(
        "{}<inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{}\"/>\n",
        "  ".repeat(depth),
        numbers(of.centre.as_slice()),
        number(of.mass),
        numbers(&[m[(0, 0)] + raised, m[(1, 1)] + raised, m[(2, 2)] + raised, m[(0, 1)], m[(0, 2)], m[(1, 2)]])
    )
}
