//! What there is to say of a model's robot.

use crate::model::{Model, Motion};
use crate::robot::{Arm, Coordinate, JointKind, Point};
use nalgebra::{DMatrix, DVector};
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
    /// Its points, each a body of the network.
    pub points: Vec<PointRow>,
    /// Whether motors hold the weight of its links in every pose.
    pub gravity_compensated: bool,
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

/// A point of a robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointRow {
    /// Its name.
    pub name: String,
    /// The link that it is on.
    pub link: String,
    /// Where, in the link's frame, m.
    pub at: [f64; 3],
    /// Along which direction of the base it is seen.
    pub axis: [f64; 3],
    /// Mass that a push along the axis feels at the pose, kg: `1/(J M⁻¹ Jᵀ)` of links and armatures; infinite where the joints cannot move it along the axis.
    pub mass: f64,
}

fn point_rows(model: &Model, arm: &Arm) -> Vec<PointRow> {
    let bodies = model.bodies.len();
    let (links, rows) = (arm.inertia_at_pose(bodies), arm.gradients_at_pose(bodies));
    let armature = |joint: usize| model.bodies.get(joint).map_or(0.0, |body| body.inertia);
    let own = |i: usize, j: usize| links[(arm.bodies[i], arm.bodies[j])] + if i == j { armature(arm.bodies[i]) } else { 0.0 };
    let inverse = DMatrix::from_fn(arm.bodies.len(), arm.bodies.len(), own).try_inverse();
    let row = |(point, all): (&Point, Vec<f64>)| {
        let along = DVector::from_iterator(arm.bodies.len(), arm.bodies.iter().map(|body| all[*body]));
        let give = inverse.as_ref().map_or(f64::NAN, |inverse| along.dot(&(inverse * &along)));
        PointRow {
            name: model.place_name(Some(point.body)).to_owned(),
            link: arm.robot.links.get(point.link).map_or("", |link| link.name.as_str()).to_owned(),
            at: point.at.into(),
            axis: point.axis.into(),
            mass: if give < 1e-12 { f64::INFINITY } else { 1.0 / give },
        }
    };
    arm.points.iter().zip(rows).map(row).collect()
}

pub(super) fn robot_row(model: &Model, arm: &Arm) -> RobotRow {
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
        points: point_rows(model, arm),
        gravity_compensated: arm.gravity_compensated,
        left_aside: arm.remarks.iter().filter(|remark| !remark.matters).map(ToString::to_string).collect(),
    }
}

/// Whether each body turns or slides: from the model, but for a robot's joints, and for bodies that elements tie to them, from the joint.
pub(super) fn motions(model: &Model) -> Vec<Motion> {
    let mut known: Vec<Option<Motion>> = vec![None; model.bodies.len()];
    let Some(arm) = &model.arm else { return vec![model.motion; model.bodies.len()] };
    for (body, coordinate) in arm.bodies.iter().zip(arm.tree.coordinates()) {
        known[*body] = Some(if coordinate.kind == JointKind::Prismatic { Motion::Translation } else { Motion::Rotation });
    }
    arm.points.iter().for_each(|point| known[point.body] = Some(Motion::Translation));
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
