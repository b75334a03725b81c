//! A position servo at a joint: the parameters of its response to commands (docs/servo.md has the equations).

mod number;

pub use number::{COUNT, FACTS, Facts, Number, Numbers};

/// A joint that a position servo drives.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoJoint {
    /// Name of the joint.
    pub joint: String,
    /// How it answers.
    pub numbers: Numbers,
}
