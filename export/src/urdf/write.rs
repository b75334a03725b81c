//! A URDF from a robot's description.

use crate::joint_terms::JointTerms;
use crate::xml::{escaped, number, numbers};
use backdrive_plant::robot::{Joint, JointKind, Link, Placement, Robot};
use nalgebra::{Rotation3, Unit};

/// Where a URDF has to say a number that the robot does not: travel of a sliding joint, m; effort, N or N m; speed, m/s or rad/s.
const UNSAID: [f64; 3] = [1e3, 1e9, 1e9];

/// `terms` by joint of the robot.
pub(super) fn written(robot: &Robot, terms: &[Option<JointTerms>], notes: &mut Vec<String>) -> String {
    let name = if robot.name.is_empty() { "robot" } else { &robot.name };
    let mut out = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", escaped(name));
    robot.links.iter().for_each(|l| out += &link(l));
    let mut unsaid = false;
    for (index, j) in robot.joints.iter().enumerate() {
        out += &joint(robot, j, terms.get(index).copied().flatten(), &mut unsaid);
    }
    if unsaid {
        notes.push(format!(
            "a URDF has to state limits: where the robot has none they are {} m, {:e} of effort and of speed",
            UNSAID[0], UNSAID[1]
        ));
    }
    out + "</robot>\n"
}

fn link(link: &Link) -> String {
    let name = escaped(&link.name);
    let Some(of) = &link.inertia else { return format!("  <link name=\"{name}\"/>\n") };
    let m = of.about_centre;
    format!(
        "  <link name=\"{name}\">\n    <inertial>\n      <origin xyz=\"{}\"/>\n      <mass value=\"{}\"/>\n      \
         <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/>\n    </inertial>\n  </link>\n",
        numbers(of.centre.as_slice()),
        number(of.mass),
        number(m[(0, 0)]),
        number(m[(0, 1)]),
        number(m[(0, 2)]),
        number(m[(1, 1)]),
        number(m[(1, 2)]),
        number(m[(2, 2)]),
    )
}

fn joint(robot: &Robot, joint: &Joint, terms: Option<JointTerms>, unsaid: &mut bool) -> String {
    let link = |index: usize| robot.links.get(index).map_or(String::new(), |l| escaped(&l.name));
    let range = joint.limits.range.filter(|[low, high]| low < high);
    let kind = match joint.kind {
        JointKind::Fixed => "fixed",
        JointKind::Prismatic => "prismatic",
        JointKind::Revolute if range.is_some() => "revolute",
        JointKind::Revolute => "continuous",
    };
    let at = at_zero(joint);
    let (roll, pitch, yaw) = Rotation3::from_matrix_unchecked(at.rotation).euler_angles();
    let mut out = format!(
        "  <joint name=\"{}\" type=\"{kind}\">\n    <parent link=\"{}\"/>\n    <child link=\"{}\"/>\n    <origin xyz=\"{}\" rpy=\"{}\"/>\n",
        escaped(&joint.name),
        link(joint.parent),
        link(joint.child),
        numbers(at.translation.as_slice()),
        numbers(&[roll, pitch, yaw]),
    );
    if let Some(terms) = terms {
        out += &format!("    <axis xyz=\"{}\"/>\n", numbers(joint.axis.as_slice()));
        out += &format!("    <dynamics damping=\"{}\" friction=\"{}\"/>\n", number(terms.damping), number(terms.friction));
        let effort = joint.limits.effort.unwrap_or(f64::INFINITY).min(terms.effort);
        *unsaid |= !effort.is_finite() || joint.limits.velocity.is_none() || (kind == "prismatic" && range.is_none());
        let bounds = match (range, joint.kind) {
            (Some([low, high]), _) => format!("lower=\"{}\" upper=\"{}\" ", number(low), number(high)),
            (None, JointKind::Prismatic) => format!("lower=\"{}\" upper=\"{}\" ", number(-UNSAID[0]), number(UNSAID[0])),
            (None, _) => String::new(),
        };
        let velocity = joint.limits.velocity.unwrap_or(UNSAID[2]);
        out += &format!(
            "    <limit {bounds}effort=\"{}\" velocity=\"{}\"/>\n",
            number(if effort.is_finite() { effort } else { UNSAID[1] }),
            number(velocity)
        );
    }
    out + "  </joint>\n"
}

/// Where the joint's frame is at the coordinate 0; a URDF knows no other reference.
fn at_zero(joint: &Joint) -> Placement {
    let back = match joint.kind {
        JointKind::Revolute => {
            let turn = Rotation3::from_axis_angle(&Unit::new_normalize(joint.axis), -joint.reference);
            Placement { rotation: *turn.matrix(), ..Placement::default() }
        }
        JointKind::Prismatic => Placement::at(-joint.axis * joint.reference),
        JointKind::Fixed => Placement::default(),
    };
    joint.origin.then(&back)
}
