//! Models written for others. Each writer is a pure function: a [`Model`] in, text and a list of what the text cannot hold out.
//!
//! - [`mjcf`]: MuJoCo 4.0. Bodies are joints, elements are attributes of joints and tendons, inputs actuators, outputs sensors.
//! - [`feedforward`]: the force of a joint's friction as a function of position, velocity and load, for a controller: C, Python or numbers as YAML.
//! - [`urdf`]: `<dynamics>` and `<limit>` of a robot's joints.
//! - [`isaac`]: joint parameters for Isaac Lab.
//!
//! A target that has no word for an element gets what is nearest, or nothing. A [`LeftOut`] records this and how it changes the model, so that the
//! resulting error can be simulated.

pub mod feedforward;
pub mod isaac;
mod joint_terms;
mod left_out;
pub mod mjcf;
mod names;
pub mod target;
pub mod urdf;
mod xml;

pub use left_out::{Change, LeftOut, Part, change_all};

use backdrive_plant::model::Model;
use std::fmt;

/// A model as another program's text.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// The file.
    pub text: String,
    /// What is not in it, or is in it as something else.
    pub left_out: Vec<LeftOut>,
    /// What a user should know besides.
    pub notes: Vec<String>,
}

/// Why a model cannot be exported at all: one sentence.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ExportError(pub String);

/// What every writer has to know of a robot: it writes joints and what acts on them. Returned is what the model's controller does besides.
///
/// # Errors
/// Where the model has points of links: what acts there acts on all joints at once, through a Jacobian that changes with the pose.
fn of_robot(model: &Model) -> Result<Vec<LeftOut>, ExportError> {
    let Some(arm) = &model.arm else { return Ok(Vec::new()) };
    if !arm.points.is_empty() {
        let names: Vec<&str> = arm.points.iter().map(|point| model.place_name(Some(point.body))).collect();
        return Err(ExportError::new(format!(
            "it has points of the robot ({}), and an export contains only joints and elements between them. Export a model file of the same \
             arm without [point.NAME], and let the graph's file name the one with points",
            names.join(", ")
        )));
    }
    let why = "holding the weight of the links is the controller's; in MuJoCo gravcomp=\"1\" of a body is the same";
    let held = LeftOut::key(Part::Robot, "gravity_compensated", "controller", why, Some(Change::NotCompensated));
    Ok(if arm.gravity_compensated { vec![held] } else { Vec::new() })
}

impl ExportError {
    fn new(message: impl fmt::Display) -> ExportError {
        ExportError(message.to_string())
    }
}
