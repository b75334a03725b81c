//! The state of the true device.

use super::drive::Drive;
use super::joint::Joint;
use super::kick::Kick;
use super::sensor::Sensor;

/// The true device, stepped one sampling period at a time. Deterministic: the same truth and inputs give the same bits.
pub struct SealedPlant {
    pub(super) names: Names,
    pub(super) joints: Vec<Joint>,
    pub(super) drives: Vec<Drive>,
    pub(super) sensors: Vec<Sensor>,
    pub(super) kick: Kick,
    pub(super) memory: Vec<f64>,
    pub(super) scratch: Vec<f64>,
    pub(super) positions: Vec<f64>,
    pub(super) middle: Vec<f64>,
    pub(super) speeds: Vec<f64>,
    pub(super) accelerations: Vec<f64>,
    pub(super) applied: Vec<f64>,
    pub(super) element_forces: Vec<f64>,
    pub(super) reactions: Vec<f64>,
    pub(super) exact: Vec<f64>,
    pub(super) measured: Vec<f64>,
    pub(super) substeps: usize,
    pub(super) substep_s: f64,
}

/// What the device calls its parts.
pub(super) struct Names {
    pub(super) bodies: Vec<String>,
    pub(super) elements: Vec<String>,
    pub(super) inputs: Vec<String>,
    pub(super) outputs: Vec<String>,
}
