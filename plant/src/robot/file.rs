//! Robot files: a [`Robot`] from URDF or MJCF, and what of the file was left aside.

use super::description::Robot;
use super::error::{Part, RobotError};
use super::found::{Found, Remark};
use super::tree::Tree;
use super::xml::{self, Element};
use super::{mjcf, urdf};
use crate::tomlfile::{FileError, read_text};
use std::path::Path;

/// What a robot file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotFile {
    /// The robot; [`Tree::new`] accepts it.
    pub robot: Robot,
    /// What of the file was left aside, and remarks on what was taken.
    pub remarks: Vec<Remark>,
}

impl RobotFile {
    /// Reads a URDF (`<robot>`) or an MJCF (`<mujoco>`) file. Errors name file, line and element.
    pub fn load(path: &Path) -> Result<RobotFile, FileError> {
        RobotFile::from_xml(&read_text(path)?, &path.display().to_string())
    }

    /// Whether a text is a URDF, by its root element.
    pub fn is_urdf(text: &str) -> bool {
        xml::parse(text, "").is_ok_and(|document| document.root_element().has_tag_name("robot"))
    }

    /// Reads the text of such a file; `name` stands for it in errors.
    pub fn from_xml(text: &str, name: &str) -> Result<RobotFile, FileError> {
        let document = xml::parse(text, name)?;
        let root = Element::root(&document, name);
        let found = match root.tag() {
            "robot" => urdf::read(root)?,
            "mujoco" => mjcf::read(root)?,
            _ => return Err(root.error("expected <robot> (a URDF) or <mujoco> (an MJCF)")),
        };
        finish(found, name)
    }
}

/// Checks what a reader has found, and reports what is doubtful in it.
fn finish(mut found: Found, file: &str) -> Result<RobotFile, FileError> {
    let line = |error: &RobotError| match error.part {
        Part::Robot => 1,
        Part::Link(link) => found.link_lines.get(link).copied().unwrap_or(1),
        Part::Joint(joint) => found.joint_lines.get(joint).copied().unwrap_or(1),
    };
    Tree::new(&found.robot).map_err(|error| FileError::at(file, line(&error), error.place.clone(), error.message.clone()))?;
    for (link, line) in found.robot.links.iter().zip(&found.link_lines) {
        if let Some(doubt) = link.doubt() {
            found.remarks.add(format!("link \"{}\"", link.name), *line, format!("{doubt}; it is computed unchanged"), false);
        }
    }
    Ok(RobotFile { robot: found.robot, remarks: found.remarks.0 })
}
