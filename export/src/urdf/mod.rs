//! URDF: `<dynamics>` and `<limit>` of joints (<https://wiki.ros.org/urdf/XML/joint>), in the text of the robot's own URDF, or in a new one.

mod links;
mod patch;
mod write;

pub use links::with_inertias;

use crate::joint_terms::{Knows, joint_terms};
use crate::left_out::{Change, LeftOut, Part};
use crate::{ExportError, Exported, of_robot};
use backdrive_plant::model::Model;
use backdrive_plant::robot::Robot;

/// The robot of a model as URDF.
///
/// # Errors
/// Where the model has no robot.
pub fn export(model: &Model) -> Result<Exported, ExportError> {
    let Some(arm) = &model.arm else {
        return Err(ExportError::new(
            "a URDF describes a robot, and this model has no [robot]; --to mjcf takes networks of one axis, --to feedforward their friction",
        ));
    };
    let knows = Knows { target: "URDF", armature: false, rest: false };
    let (terms, mut left_out) = joint_terms(model, arm, knows);
    let mut of_joints = vec![None; arm.robot.joints.len()];
    for (coordinate, terms) in arm.tree.coordinates().iter().zip(terms) {
        if let Some(place) = of_joints.get_mut(coordinate.joint) {
            *place = Some(terms);
        }
    }
    let mut notes = Vec::new();
    left_out.extend(of_robot(model)?);
    let is_urdf = roxmltree::Document::parse(&arm.xml).is_ok_and(|d| d.root_element().has_tag_name("robot"));
    let text = match is_urdf {
        true => patch::patched(&arm.xml, &arm.robot, &of_joints, &mut notes)?,
        false => {
            let why = "a URDF is written from bodies, joints and their inertia";
            left_out.push(LeftOut::key(Part::Robot, "geoms, sites, cameras and what else the MJCF has", "mjcf", why, None));
            write::written(&arm.robot, &of_joints, &mut notes)
        }
    };
    if arm.robot.gravity != Robot::default().gravity {
        let [x, y, z] = arm.robot.gravity.into();
        let why = format!("({x}, {y}, {z}) m/s² is not part of a URDF: set it in the program that reads the file");
        let usual = Change::Gravity(Robot::default().gravity);
        left_out.push(LeftOut::key(Part::Robot, "gravity", "gravity", why, Some(usual)).replaced_by("(0, 0, -9.81) m/s²"));
    }
    if arm.tree.coordinates().iter().zip(&arm.pose).any(|(_, pose)| *pose != 0.0) {
        let why = "the coordinates at which the model's positions are 0 are no part of a URDF";
        left_out.push(LeftOut::key(Part::Robot, "pose", "pose", why, None));
    }
    Ok(Exported { text, left_out, notes })
}

/// A robot's links and joints as a new URDF. Read again it is the same robot, except for what a URDF has no word for: armature, springs, and a reference
/// of a joint, from which coordinates then count.
pub fn robot_as_urdf(robot: &Robot) -> String {
    write::alone(robot)
}
