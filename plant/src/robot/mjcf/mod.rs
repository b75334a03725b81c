//! MJCF: the models of MuJoCo. Of the format is read what describes bodies, joints, inertias, motors, and a joint's armature, friction and springs.
//! There is a remark for the rest, and an element that would change the mechanics is refused.
//!
//! The format is that of <https://mujoco.readthedocs.io/en/stable/XMLreference.html>. A body with several joints becomes a chain of links without mass.

mod actuator;
mod body;
mod compiler;
mod defaults;
mod geom;
mod joint;
mod orientation;

use super::description::{Link, Robot};
use super::found::{Found, Remarks};
use super::xml::Element;
use crate::tomlfile::FileError;
use compiler::{Compiler, SAVE_WHOLE};
use defaults::Defaults;
use nalgebra::Vector3;

pub(super) fn read(root: Element) -> Result<Found, FileError> {
    let mut found =
        Found { robot: Robot { name: root.attribute("model").unwrap_or_default().to_owned(), ..Robot::default() }, ..Found::default() };
    let compiler = Compiler::read(root)?;
    let defaults = Defaults::read(root)?;
    found.robot.links.push(Link { name: "world".to_owned(), inertia: None });
    found.link_lines.push(root.line());
    for section in root.children() {
        match section.tag() {
            "option" => option(section, &mut found)?,
            "worldbody" => body::world(section, &compiler, &defaults, &mut found)?,
            _ => {}
        }
    }
    for section in root.children_named("actuator") {
        actuator::read(section, &compiler, &defaults, &mut found)?;
    }
    for section in root.children() {
        left_aside(section, &mut found.remarks)?;
    }
    if found.robot.joints.iter().all(|joint| joint.kind == super::JointKind::Fixed) {
        return Err(root.error("has no joint that moves: <worldbody> has to hold bodies with a <joint>"));
    }
    Ok(found)
}

fn option(section: Element, found: &mut Found) -> Result<(), FileError> {
    if let Some(gravity) = section.vector("gravity")? {
        found.robot.gravity = gravity;
    }
    for flag in section.children_named("flag") {
        if flag.attribute("gravity") == Some("disable") {
            found.robot.gravity = Vector3::zeros();
        }
    }
    for name in ["density", "viscosity", "wind"] {
        if let Some(text) = section.attribute(name)
            && section.as_numbers(name, text)?.iter().any(|number| *number != 0.0)
        {
            found.remarks.add(format!("<option {name}>"), section.line(), "the drag of the surrounding air or water is not computed", true);
        }
    }
    Ok(())
}

/// The remarks on the sections that are not read.
fn left_aside(section: Element, remarks: &mut Remarks) -> Result<(), FileError> {
    let (message, matters) = match section.tag() {
        "compiler" | "default" | "worldbody" | "actuator" => return Ok(()),
        "include" => return Err(section.error(format!("other files are not read in: {SAVE_WHOLE}"))),
        "equality" => {
            let acting = section.children().find(|e| e.attribute("active") != Some("false"));
            if let Some(equality) = acting {
                let message = "ties bodies or joints to each other, which a tree cannot represent. Remove it, or give it \
                               active=\"false\"; a stiff spring between two joints in the model file can tie them";
                return Err(equality.error(message));
            }
            return Ok(());
        }
        "option" => ("gravity is read; the rest is MuJoCo's way of integrating", false),
        "tendon" => ("tendons are not computed, and with them their springs, friction and motors", true),
        "contact" => ("contacts between bodies are not computed", true),
        "deformable" => ("what bends is not computed", true),
        "asset" | "visual" | "statistic" | "size" | "custom" | "keyframe" => ("not read: it does not move", false),
        "sensor" => ("ignored: measured signals are outputs of the model file", false),
        "extension" => ("plugins are not read", true),
        _ => ("not known, and not read", true),
    };
    remarks.add(format!("<{}>", section.tag()), section.line(), message, matters);
    Ok(())
}
