//! Why a robot cannot be computed.

use std::fmt;

/// A part of a robot, by index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// As a whole.
    Robot,
    /// A link.
    Link(usize),
    /// A joint.
    Joint(usize),
}

/// Why a robot cannot be computed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RobotError {
    /// Which part is at fault, for those who know where in a file it stands.
    pub part: Part,
    /// The part, such as `link "forearm"`.
    pub place: String,
    /// What is wrong and what to do.
    pub message: String,
}

impl fmt::Display for RobotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.message)
    }
}

impl std::error::Error for RobotError {}
