//! What a model is written for, and the writer of each.

use crate::feedforward::{self, Language};
use crate::{ExportError, Exported, isaac, mjcf, urdf};
use backdrive_plant::model::Model;

/// What a model is written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// MuJoCo 4.0.
    Mjcf,
    /// Joints of a robot: dynamics and limits.
    Urdf,
    /// Joints of a robot for Isaac Lab 2.3 on Isaac Sim 5.
    Isaac,
    /// Friction as a function of position, velocity and load, for a controller.
    Feedforward,
}

impl Target {
    /// All of them.
    pub const ALL: [Target; 4] = [Target::Mjcf, Target::Urdf, Target::Isaac, Target::Feedforward];

    /// Its word on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Target::Mjcf => "mjcf",
            Target::Urdf => "urdf",
            Target::Isaac => "isaac",
            Target::Feedforward => "feedforward",
        }
    }
}

/// How a model is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// For what.
    pub to: Target,
    /// Of a feed-forward: what it is written in.
    pub language: Language,
    /// Of a feed-forward: width of the smooth sign, m/s or rad/s; `None` for one that suits the model.
    pub width: Option<f64>,
    /// Of an MJCF: its time step, s; `None` for one that suits the model.
    pub step: Option<f64>,
}

/// Writes a model.
///
/// # Errors
/// The target cannot hold the model at all.
pub fn export(model: &Model, options: &Options) -> Result<Exported, ExportError> {
    match options.to {
        Target::Mjcf => mjcf::export(model, options.step),
        Target::Urdf => urdf::export(model),
        Target::Isaac => isaac::export(model),
        Target::Feedforward => feedforward::export(model, options.language, options.width),
    }
}
