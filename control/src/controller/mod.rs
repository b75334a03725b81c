//! The controller of a slave that is driven by a force: it makes the tip go where the command says.
//!
//! A law is a pure function of (reference, state) and its own memory: [`pd`], [`sliding_mode`], [`backstepping`], each one a file. What a
//! law knows of the axis, inertia and friction, is a model's ([`axis`]), which need not be the real one.

pub mod axis;
pub mod backstepping;
mod node;
pub mod pd;
pub mod reference;
pub mod sliding_mode;

pub use axis::{AxisModel, Bristles};
pub use backstepping::Backstepping;
pub use node::Controller;
pub use pd::Pd;
pub use reference::{Differentiator, ReferenceFilter};
pub use sliding_mode::SlidingMode;

/// Where the axis shall be.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reference {
    /// q_r, m or rad.
    pub position: f64,
    /// m/s or rad/s.
    pub velocity: f64,
    /// m/s² or rad/s².
    pub acceleration: f64,
}

/// Where it is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// q, m or rad.
    pub position: f64,
    /// m/s or rad/s.
    pub velocity: f64,
}

/// Whether friction of the model is put on top of a law's force, along the reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Feedforward {
    /// Nothing is.
    #[default]
    None,
    /// The model's friction on the reference's path is.
    Friction,
}

/// Gains of a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// [`Pd`].
    Pd(pd::Gains, Feedforward),
    /// [`SlidingMode`].
    SlidingMode(sliding_mode::Gains, Feedforward),
    /// [`Backstepping`].
    Backstepping(backstepping::Gains),
}

impl Law {
    /// Name in graph files.
    pub fn name(&self) -> &'static str {
        match self {
            Law::Pd(..) => "pd",
            Law::SlidingMode(..) => "sliding_mode",
            Law::Backstepping(..) => "backstepping",
        }
    }
}

/// A controller as a graph describes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The law.
    pub law: Law,
    /// Corner of the filter that makes speed and acceleration of a command, Hz.
    pub reference_hz: f64,
    /// Corner of the low-pass on the measured position's differences, Hz.
    pub velocity_hz: f64,
}

/// Why a controller cannot be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ControllerError {
    /// The law needs what only a model says.
    #[error("law \"{law}\" needs a model: it says the axis' inertia and friction")]
    NeedsModel {
        /// Name of the law.
        law: &'static str,
    },
    /// The model has not what is needed.
    #[error("model \"{model}\", axis {axis}: {reason}")]
    Model {
        /// The model.
        model: String,
        /// Index of the axis.
        axis: usize,
        /// One sentence.
        reason: String,
    },
}

/// The sign of the sliding variable, or its share within a boundary layer (Slotine & Li 1991, 7.2) where `boundary` is above 0.
#[inline]
pub fn switching_sign(surface: f64, boundary: f64) -> f64 {
    if boundary > 0.0 {
        (surface / boundary).clamp(-1.0, 1.0)
    } else if surface == 0.0 {
        0.0
    } else {
        surface.signum()
    }
}

/// A law at work on one axis.
#[derive(Debug, Clone)]
pub enum Working {
    /// See [`Pd`].
    Pd(Pd),
    /// See [`SlidingMode`].
    SlidingMode(SlidingMode),
    /// See [`Backstepping`].
    Backstepping(Box<Backstepping>),
}

impl Working {
    /// A law with what it knows of its axis.
    ///
    /// # Errors
    /// When it needs a model, or bristles of it, that are not there.
    pub fn new(law: &Law, axis: Option<&AxisModel>) -> Result<Working, ControllerError> {
        let known = |law: &'static str| axis.cloned().ok_or(ControllerError::NeedsModel { law });
        Ok(match law {
            Law::Pd(gains, Feedforward::None) => Working::Pd(Pd::new(*gains, None)),
            Law::Pd(gains, Feedforward::Friction) => Working::Pd(Pd::new(*gains, Some(known("pd with friction = \"feedforward\"")?))),
            Law::SlidingMode(gains, feedforward) => Working::SlidingMode(SlidingMode::new(*gains, known("sliding_mode")?, *feedforward)),
            Law::Backstepping(gains) => Working::Backstepping(Box::new(Backstepping::new(*gains, known("backstepping")?)?)),
        })
    }

    /// The force on the motor, N or N m, for a step of `period_s`.
    pub fn effort(&mut self, reference: &Reference, state: &State, period_s: f64) -> f64 {
        match self {
            Working::Pd(law) => law.effort(reference, state, period_s),
            Working::SlidingMode(law) => law.effort(reference, state, period_s),
            Working::Backstepping(law) => law.effort(reference, state, period_s),
        }
    }
}
