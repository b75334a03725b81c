//! What there is to say of a model's robot.

use crate::model::{Model, Motion};
use crate::robot::{Arm, Coordinate, JointKind};
use serde::Serialize;

/// A robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RobotRow {
    /// Its name.
    pub name: String,
    /// Free fall, seen from the base, m/s².
    pub gravity: [f64; 3],
    /// Mass of everything that moves, kg.
    pub mass: f64,
    /// Its joints, each a body of the network.
    pub joints: Vec<JointRow>,
    /// What of its file was left aside, with lines, and does not change the motion; what does is among the remarks.
    pub left_aside: Vec<String>,
}

/// A joint of a robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointRow {
    /// Its name.
    pub name: String,
    /// `revolute` or `prismatic`.
    pub kind: &'static str,
    /// The link that it carries.
    pub link: String,
    /// Coordinate at the pose, rad or m.
    pub pose: f64,
    /// `rad` or `m`.
    pub unit: &'static str,
    /// Inertia of the links that it feels at the pose, when the other joints stand still, kg m² or kg.
    pub inertia: f64,
    /// Force that holds it against gravity at the pose, N m or N.
    pub gravity: f64,
}

pub(super) fn robot_row(arm: &Arm) -> RobotRow {
    let count = arm.tree.len();
    let mass = arm.inertia_at_pose(count.max(arm.bodies.iter().max().map_or(0, |last| last + 1)));
    let (mut gravity, mut work) = (vec![0.0; count], arm.tree.workspace());
    arm.tree.gravity(&arm.pose, &mut work, &mut gravity);
    let row = |(i, coordinate): (usize, &Coordinate)| {
        let joint = arm.robot.joints.get(coordinate.joint);
        let link = joint.and_then(|joint| arm.robot.links.get(joint.child)).map_or("", |link| link.name.as_str());
        JointRow {
            name: coordinate.name.clone(),
            kind: if coordinate.kind == JointKind::Prismatic { "prismatic" } else { "revolute" },
            link: link.to_owned(),
            pose: arm.pose[i],
            unit: coordinate.kind.unit(),
            inertia: mass[(arm.bodies[i], arm.bodies[i])],
            gravity: gravity[i],
        }
    };
    RobotRow {
        name: arm.robot.name.clone(),
        gravity: arm.robot.gravity.into(),
        mass: arm.tree.moving_mass(),
        joints: arm.tree.coordinates().iter().enumerate().map(row).collect(),
        left_aside: arm.remarks.iter().filter(|remark| !remark.matters).map(ToString::to_string).collect(),
    }
}

/// Whether each body turns or slides: as the model says, but of a robot's joints, and of what elements tie to them, as the joint does.
pub(super) fn motions(model: &Model) -> Vec<Motion> {
    let mut known: Vec<Option<Motion>> = vec![None; model.bodies.len()];
    let Some(arm) = &model.arm else { return vec![model.motion; model.bodies.len()] };
    for (body, coordinate) in arm.bodies.iter().zip(arm.tree.coordinates()) {
        known[*body] = Some(if coordinate.kind == JointKind::Prismatic { Motion::Translation } else { Motion::Rotation });
    }
    // Each round reaches one element further.
    for _ in 0..model.bodies.len() {
        for element in &model.elements {
            if let [Some(a), Some(b)] = element.between {
                match (known[a], known[b]) {
                    (Some(motion), None) => known[b] = Some(motion),
                    (None, Some(motion)) => known[a] = Some(motion),
                    _ => {}
                }
            }
        }
    }
    known.into_iter().map(|motion| motion.unwrap_or(model.motion)).collect()
}
