//! The part of a verdict on joints that position servos drive.

use super::finding::Estimate;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Additional results of a diagnosis from commands and positions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ServoPart {
    /// Each joint, in the order of the set.
    pub joints: Vec<ServoAnswer>,
    /// What absolute forces rest on, in one sentence; without a scale forces are angles: over the servo's proportional gain.
    pub scale: String,
}

/// How one joint answers its commands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ServoAnswer {
    /// Its name.
    pub joint: String,
    /// Errors of free runs from the commands alone on held-out recordings; of a set that holds none out, on recordings that were left out of the fit in turn.
    pub errors: ServoErrors,
    /// Numbers of the diagnosed joint, by their keys in the model file; forces over the proportional gain.
    pub numbers: BTreeMap<String, Estimate>,
    /// Proportional gain, N m/rad, if gravity and the masses of the robot file determine it; otherwise null.
    pub gain: Option<Estimate>,
    /// Effects that cannot be separated at this joint.
    #[serde(default)]
    pub shared: Vec<SharedCause>,
}

/// Errors of a free run: as a share of the recorded position's standard deviation (median over the recordings in which the joint moves), and the mean
/// absolute error in rad (mean over the recordings). Null where no recording moves the joint.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ServoErrors {
    /// Of the command itself taken for the position.
    pub command: Option<f64>,
    /// Of the model as given, or of a delay, a second order and an offset.
    pub refit: Option<f64>,
    /// Of the diagnosed joint.
    pub diagnosed: Option<f64>,
    /// Mean absolute error of the command, rad.
    pub command_mae: f64,
    /// The same with a delay, a second order and an offset, rad.
    pub refit_mae: f64,
    /// The same of the diagnosed joint, rad.
    pub diagnosed_mae: f64,
}

/// Causes that these recordings do not tell apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SharedCause {
    /// The physics, by name.
    pub causes: Vec<String>,
    /// What they share, in one sentence.
    pub sentence: String,
    /// The motion that separates them.
    pub separated_by: String,
}
