//! `[robot]` and `[joint.NAME]`: a robot whose joints are bodies of the network, and what drives each joint.

use super::network::{only_fragment, read_fragment};
use crate::elements::{Coulomb, Damper, Law, Range, Spring};
use crate::model::{Body, Element, Hold, Input, InputKind, Model, Motion};
use crate::robot::{Arm, JointKind, RobotFile};
use crate::tomlfile::{self, FileError, Table};
use nalgebra::{Rotation3, Vector3};
use std::path::Path;

/// Reads `[robot]`: its joints become the first bodies of the model, and the friction and springs in its file become elements.
pub(super) fn read_robot(table: &mut Table, model: &mut Model, folder: Option<&Path>) -> Result<(), FileError> {
    let (xml, name) = text(table, folder)?;
    let RobotFile { mut robot, remarks } = RobotFile::from_xml(&xml, &name)?;
    match table.numbers("gravity", Range::Any)?.as_deref() {
        None => {}
        Some(&[x, y, z]) => robot.gravity = Vector3::new(x, y, z),
        Some(_) => return Err(table.error_at("gravity", "expected three numbers, m/s²: free fall along x, y and z")),
    }
    match table.numbers("base", Range::Any)?.as_deref() {
        None => {}
        Some(&[roll, pitch, yaw]) => robot.gravity = Rotation3::from_euler_angles(roll, pitch, yaw).inverse() * robot.gravity,
        Some(_) => {
            return Err(table.error_at("base", "expected three numbers, rad: how the base is turned about the world's x, y and z axes"));
        }
    }
    let mut arm = Arm::new(xml, robot, 0).map_err(|error| FileError::whole(name, error.to_string()))?;
    arm.remarks = remarks;
    if let Some(mut pose) = table.table("pose")? {
        for joint in pose.keys() {
            let names = || arm.tree.coordinates().iter().map(|c| c.name.as_str());
            let Some(index) = names().position(|name| name == joint) else {
                return Err(pose.error_at(&joint, tomlfile::unknown("joint", &joint, names())));
            };
            arm.pose[index] = pose.need_number(&joint, Range::Any)?;
        }
        pose.finish()?;
    }
    arm.gravity_compensated = table.boolean("gravity_compensated")?.unwrap_or(false);
    let passive = table.boolean("passive")?.unwrap_or(true);
    let actuators = table.boolean("actuators")?.unwrap_or(false);
    for (body, coordinate) in arm.tree.coordinates().iter().enumerate() {
        let joint = &arm.robot.joints[coordinate.joint];
        model.bodies.push(Body { name: joint.name.clone(), inertia: joint.armature });
        if !passive {
            continue;
        }
        let mut add = |what: &str, law: Law| {
            model.elements.push(Element { name: format!("{}_{what}", joint.name), between: [Some(body), None], law });
        };
        if joint.damping > 0.0 {
            add("damping", Law::Damper(Damper { damping: joint.damping }));
        }
        if joint.friction > 0.0 {
            add("friction", Law::Coulomb(Coulomb { force: joint.friction }));
        }
        if joint.stiffness > 0.0 {
            add("spring", Law::Spring(Spring { stiffness: joint.stiffness, rest: joint.rest - arm.pose[body] }));
        }
    }
    for actuator in arm.robot.actuators.iter().filter(|_| actuators) {
        let on = arm.tree.coordinates().iter().position(|c| c.joint == actuator.joint);
        let Some(on) = on else { continue };
        let ideal = Input::ideal(&actuator.name, InputKind::Force, on, Hold::Zero);
        model.inputs.push(Input { gain: actuator.gear, saturation: actuator.limit, ..ideal });
    }
    model.arm = Some(Box::new(arm));
    Ok(())
}

/// The robot file's text, and what it is called in errors.
fn text(table: &mut Table, folder: Option<&Path>) -> Result<(String, String), FileError> {
    match (table.string("file")?, table.string("xml")?) {
        (Some(_), Some(_)) => Err(table.error_at("xml", "has both \"file\" and \"xml\"; expected one of them")),
        (None, Some(xml)) => Ok((xml, format!("{} robot.xml", table.file_name()))),
        (None, None) => Err(table.missing("file")),
        (Some(file), None) => {
            let Some(path) = folder
                .map(|folder| folder.join(&file))
                .or_else(|| Some(file.clone().into()).filter(|p: &std::path::PathBuf| p.is_absolute()))
            else {
                return Err(table.error_at("file", format!("names the file \"{file}\", and this model is not in a folder")));
            };
            let text = tomlfile::read_text(&path).map_err(|e| table.error_at("file", format!("\"{file}\": {}", e.message)))?;
            Ok((text, path.display().to_string()))
        }
    }
}

/// rad where any joint turns, else m.
pub(super) fn motion(model: &Model) -> Option<Motion> {
    let arm = model.arm.as_ref()?;
    let turns = arm.tree.coordinates().iter().any(|c| c.kind == JointKind::Revolute);
    Some(if turns { Motion::Rotation } else { Motion::Translation })
}

/// Reads `[joint.NAME]`: the network that drives a joint, in the table itself or in a file, attached with its port at the joint.
pub(super) fn read_joints(top: &mut Table, model: &mut Model, folder: Option<&Path>) -> Result<(), FileError> {
    let Some(mut joints) = top.table("joint")? else { return Ok(()) };
    let Some(arm) = &model.arm else {
        return Err(
            joints.error("only a model with a [robot] has joints; bodies and elements of one axis belong in [bodies] and [[elements]]")
        );
    };
    let names: Vec<String> = arm.tree.coordinates().iter().map(|c| c.name.clone()).collect();
    for name in joints.keys() {
        let Some(body) = names.iter().position(|joint| *joint == name) else {
            return Err(joints.error_at(&name, tomlfile::unknown("joint", &name, names.iter().map(String::as_str))));
        };
        let Some(mut table) = joints.table(&name)? else { continue };
        let fragment = match table.string("network")? {
            Some(file) => {
                let Some(folder) = folder else {
                    return Err(table.error_at("network", format!("names the file \"{file}\", and this model is not in a folder")));
                };
                let path = folder.join(&file);
                only_fragment(Table::open(&path)?, path.parent())?
            }
            None => read_fragment(&mut table, folder)?,
        };
        table.finish()?;
        if let Some(hand) = fragment.hand {
            let hand = fragment.network.bodies.get(hand).map_or("hand", |body| body.name.as_str());
            return Err(joints.error_at(&name, format!("its network has a body \"{hand}\", which is for grips; anchor it at \"ground\"")));
        }
        model.attach(&fragment, body, &name);
    }
    joints.finish()
}
