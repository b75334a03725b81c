//! A URDF from a robot's description.

use crate::joint_terms::JointTerms;
use crate::xml::{escaped, number, numbers};
use backdrive_plant::robot::{Joint, JointKind, Link, LinkInertia, Placement, Robot};
use nalgebra::{Matrix3, Rotation3, Unit};

/// Where a URDF has to say a number that the robot does not: travel of a sliding joint, m; effort, N or N m; speed, m/s or rad/s.
pub(super) const UNSAID: [f64; 3] = [1e3, 1e9, 1e9];

/// The links and joints of a robot and nothing else: read again it is the same robot. Limits that the robot does not have are not stated.
pub(super) fn alone(robot: &Robot) -> String {
    text(robot, |_, joint| {
        let mut out = String::new();
        if joint.damping != 0.0 || joint.friction != 0.0 {
            out += &format!("    <dynamics damping=\"{}\" friction=\"{}\"/>\n", number(joint.damping), number(joint.friction));
        }
        let range = joint.limits.range.map_or([None; 2], |range| range.map(Some));
        let stated = [("lower", range[0]), ("upper", range[1]), ("effort", joint.limits.effort), ("velocity", joint.limits.velocity)];
        let stated: Vec<String> = stated.into_iter().filter_map(|(name, value)| Some(format!(" {name}=\"{}\"", number(value?)))).collect();
        if !stated.is_empty() {
            out += &format!("    <limit{}/>\n", stated.concat());
        }
        out
    })
}

/// For other programs, which want every limit stated. `terms` by joint of the robot.
pub(super) fn written(robot: &Robot, terms: &[Option<JointTerms>], notes: &mut Vec<String>) -> String {
    let mut unsaid = false;
    let out = text(robot, |index, joint| {
        let own = JointTerms { damping: joint.damping, friction: joint.friction, effort: f64::INFINITY, ..JointTerms::default() };
        dynamics(joint, terms.get(index).copied().flatten().unwrap_or(own), &mut unsaid)
    });
    if unsaid {
        notes.push(format!(
            "a URDF has to state limits: where the robot has none they are {} m, {:e} of effort and of speed",
            UNSAID[0], UNSAID[1]
        ));
    }
    out
}

/// `of_joint`: what a joint that moves has besides its place and its axis.
fn text(robot: &Robot, mut of_joint: impl FnMut(usize, &Joint) -> String) -> String {
    let name = if robot.name.is_empty() { "robot" } else { &robot.name };
    let mut out = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", escaped(name));
    robot.links.iter().for_each(|l| out += &link(l));
    for (index, joint) in robot.joints.iter().enumerate() {
        out += &placed(robot, joint);
        if joint.kind != JointKind::Fixed {
            out += &format!("    <axis xyz=\"{}\"/>\n", numbers(joint.axis.as_slice()));
            out += &of_joint(index, joint);
        }
        out += "  </joint>\n";
    }
    out + "</robot>\n"
}

fn link(link: &Link) -> String {
    let name = escaped(&link.name);
    let Some(of) = &link.inertia else { return format!("  <link name=\"{name}\"/>\n") };
    format!("  <link name=\"{name}\">\n    {}\n  </link>\n", inertial(of))
}

/// Mass, centre of mass and inertia about it.
pub(super) fn inertial(of: &LinkInertia) -> String {
    let m = of.about_centre;
    format!(
        "<inertial>\n      <origin xyz=\"{}\"/>\n      <mass value=\"{}\"/>\n      \
         <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/>\n    </inertial>",
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

fn placed(robot: &Robot, joint: &Joint) -> String {
    let link = |index: usize| robot.links.get(index).map_or(String::new(), |l| escaped(&l.name));
    let at = at_zero(joint);
    format!(
        "  <joint name=\"{}\" type=\"{}\">\n    <parent link=\"{}\"/>\n    <child link=\"{}\"/>\n    <origin xyz=\"{}\" rpy=\"{}\"/>\n",
        escaped(&joint.name),
        kind(joint),
        link(joint.parent),
        link(joint.child),
        numbers(at.translation.as_slice()),
        numbers(&roll_pitch_yaw(&at.rotation)),
    )
}

fn kind(joint: &Joint) -> &'static str {
    match joint.kind {
        JointKind::Fixed => "fixed",
        JointKind::Prismatic => "prismatic",
        JointKind::Revolute if joint.limits.range.is_some() => "revolute",
        JointKind::Revolute => "continuous",
    }
}

fn dynamics(joint: &Joint, terms: JointTerms, unsaid: &mut bool) -> String {
    let range = joint.limits.range;
    let effort = joint.limits.effort.unwrap_or(f64::INFINITY).min(terms.effort);
    *unsaid |= !effort.is_finite() || joint.limits.velocity.is_none() || (joint.kind == JointKind::Prismatic && range.is_none());
    let bounds = match (range, joint.kind) {
        (Some([low, high]), _) => format!("lower=\"{}\" upper=\"{}\" ", number(low), number(high)),
        (None, JointKind::Prismatic) => format!("lower=\"{}\" upper=\"{}\" ", number(-UNSAID[0]), number(UNSAID[0])),
        (None, _) => String::new(),
    };
    format!(
        "    <dynamics damping=\"{}\" friction=\"{}\"/>\n    <limit {bounds}effort=\"{}\" velocity=\"{}\"/>\n",
        number(terms.damping),
        number(terms.friction),
        number(if effort.is_finite() { effort } else { UNSAID[1] }),
        number(joint.limits.velocity.unwrap_or(UNSAID[2]))
    )
}

/// Turns about the fixed x, y and z axes, rad. The yaw is taken first and turned back, so that the three make the same rotation to rounding also where the
/// pitch is near ±90°. Roll and yaw are then not determined individually.
fn roll_pitch_yaw(r: &Matrix3<f64>) -> [f64; 3] {
    let yaw = r[(1, 0)].atan2(r[(0, 0)]);
    let (sin, cos) = yaw.sin_cos();
    let roll = (sin * r[(0, 2)] - cos * r[(1, 2)]).atan2(cos * r[(1, 1)] - sin * r[(0, 1)]);
    let pitch = (-r[(2, 0)]).atan2(cos * r[(0, 0)] + sin * r[(1, 0)]);
    [roll, pitch, yaw]
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
