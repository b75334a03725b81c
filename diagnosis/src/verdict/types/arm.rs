//! The part of a verdict that only arms have.

use super::finding::Interval;
use super::shown::Where;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Additional results of the diagnosis of an arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ArmPart {
    /// Corner of the filter that measured torque and every regressor went through, Hz.
    pub corner_hz: f64,
    /// Each joint, from the base outwards.
    pub joints: Vec<ArmJoint>,
    /// The combinations of inertial parameters that the motion of this arm can show (Gautier 1991).
    #[serde(default)]
    pub base_parameters: Vec<BaseParameter>,
}

/// What is left of the torque of a joint on held-out logs (of a set that holds none out, on those that were fitted), as a share of its rms, both through
/// the filter of the regression.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ArmJoint {
    /// Its name in the robot file.
    pub joint: String,
    /// Root mean square of the measured torque, N m or N.
    pub torque_rms: f64,
    /// By the nominal model as given.
    pub as_given: f64,
    /// With its parameters refitted.
    pub refit: f64,
    /// By the diagnosed model.
    pub diagnosed: f64,
    /// Closed-loop simulation with the measured torque: the torque that the controller added to keep the measured motion, as a share of the
    /// rms torque, by the refitted nominal model; null where it cannot be simulated.
    pub loop_refit: Option<f64>,
    /// The same by the diagnosed model.
    pub loop_diagnosed: Option<f64>,
    /// What remains by the diagnosed model while the joint moves, as a share of its rms torque. Not in other files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moving: Option<f64>,
    /// What noise of the torque sensor, and noise and steps of the position sensors in the accelerations, would leave of that. Not in other files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<f64>,
    /// Where what remains shows; only where it is much more than the noise explains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shows: Option<Where>,
}

/// A base parameter: an inertial parameter and those that always appear with it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseParameter {
    /// Such as `Iyy2 + 0.09 m3`: `m`, `mx`, `Ixx`, ... with the number of the joint; of mass times centre and inertia about the joint's frame.
    pub name: String,
    /// As fitted, in `unit`.
    pub value: f64,
    /// 95 % interval, in `unit`.
    pub ci95: Interval,
    /// As the nominal file has it, in `unit`.
    pub nominal: f64,
    /// `kg`, `kg m` or `kg m²`.
    pub unit: String,
}
