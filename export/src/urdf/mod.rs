//! URDF: `<dynamics>` and `<limit>` of joints (<https://wiki.ros.org/urdf/XML/joint>), in the text of the robot's own URDF, or in a new one.

mod patch;
mod write;

use crate::joint_terms::{Knows, joint_terms};
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
    let (terms, left_out) = joint_terms(model, arm, knows);
    let mut of_joints = vec![None; arm.robot.joints.len()];
    for (coordinate, terms) in arm.tree.coordinates().iter().zip(terms) {
        if let Some(place) = of_joints.get_mut(coordinate.joint) {
            *place = Some(terms);
        }
    }
    let mut notes = of_robot(model)?;
    let is_urdf = roxmltree::Document::parse(&arm.xml).is_ok_and(|d| d.root_element().has_tag_name("robot"));
    let text = match is_urdf {
        true => patch::patched(&arm.xml, &arm.robot, &of_joints)?,
        false => {
            notes.push("what an MJCF has besides bodies, joints and their inertia (geoms, sites, cameras) is not in the URDF".to_owned());
            write::written(&arm.robot, &of_joints, &mut notes)
        }
    };
    if arm.robot.gravity != Robot::default().gravity {
        let [x, y, z] = arm.robot.gravity.into();
        notes.push(format!("gravity ({x}, {y}, {z}) m/s² is no part of a URDF: tell the program that reads it"));
    }
    if arm.tree.coordinates().iter().zip(&arm.pose).any(|(_, pose)| *pose != 0.0) {
        notes.push("the pose at which the model's positions are 0 is no part of a URDF".to_owned());
    }
    Ok(Exported { text, left_out, notes })
}

/// A robot's links and joints as a new URDF, without friction of its joints, and what it cannot say.
pub fn robot_as_urdf(robot: &Robot) -> (String, Vec<String>) {
    let mut notes = Vec::new();
    let text = write::written(robot, &vec![None; robot.joints.len()], &mut notes);
    (text, notes)
}
