//! Robot files: a [`Robot`] from URDF or MJCF, and what of the file was left aside.

use super::description::Robot;
use super::error::{Part, RobotError};
use super::tree::Tree;
use super::xml::{self, Element};
use super::{mjcf, urdf};
use crate::tomlfile::{FileError, read_text};
use std::fmt;
use std::path::Path;

/// What a robot file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotFile {
    /// The robot; [`Tree::new`] accepts it.
    pub robot: Robot,
    /// What of the file was left aside, and remarks on what was taken.
    pub remarks: Vec<Remark>,
}

/// Something of a file that is not computed, or is doubtful.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// What it is about, such as `<collision>`.
    pub about: String,
    /// How often it stands in the file.
    pub times: usize,
    /// Line where it stands first, from 1.
    pub line: usize,
    /// What is made of it, or why nothing is.
    pub message: String,
    /// Whether the motion would be another if it were computed.
    pub matters: bool,
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.times {
            1 => write!(f, "line {}: {}: {}", self.line, self.about, self.message),
            times => write!(f, "line {} and {} more: {}: {}", self.line, times - 1, self.about, self.message),
        }
    }
}

/// Remarks as they come up; what comes up again is counted.
#[derive(Debug, Default)]
pub(super) struct Remarks(pub(super) Vec<Remark>);

impl Remarks {
    pub(super) fn add(&mut self, about: impl Into<String>, line: usize, message: impl Into<String>, matters: bool) {
        let (about, message) = (about.into(), message.into());
        match self.0.iter_mut().find(|remark| remark.about == about && remark.message == message) {
            Some(remark) => remark.times += 1,
            None => self.0.push(Remark { about, times: 1, line, message, matters }),
        }
    }
}

/// A robot as a reader has found it, with the lines of its parts.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) robot: Robot,
    pub(super) link_lines: Vec<usize>,
    pub(super) joint_lines: Vec<usize>,
    pub(super) remarks: Remarks,
}

impl RobotFile {
    /// Reads a URDF (`<robot>`) or an MJCF (`<mujoco>`) file. Errors name file, line and element.
    pub fn load(path: &Path) -> Result<RobotFile, FileError> {
        RobotFile::from_xml(&read_text(path)?, &path.display().to_string())
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
        found.finish(name)
    }
}

impl Found {
    fn finish(mut self, file: &str) -> Result<RobotFile, FileError> {
        let line = |error: &RobotError| match error.part {
            Part::Robot => 1,
            Part::Link(link) => self.link_lines.get(link).copied().unwrap_or(1),
            Part::Joint(joint) => self.joint_lines.get(joint).copied().unwrap_or(1),
        };
        Tree::new(&self.robot).map_err(|error| FileError::at(file, line(&error), error.place.clone(), error.message.clone()))?;
        for (link, line) in self.robot.links.iter().zip(&self.link_lines) {
            if let Some(doubt) = link.doubt() {
                self.remarks.add(format!("link \"{}\"", link.name), *line, format!("{doubt}; it is computed as it stands"), false);
            }
        }
        Ok(RobotFile { robot: self.robot, remarks: self.remarks.0 })
    }
}
