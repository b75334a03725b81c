//! What a reader has found in a robot file, and what it has to say about it.

use super::description::Robot;
use std::fmt;

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
