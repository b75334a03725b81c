//! The laws: their gains, and one at work.

use super::axis::AxisModel;
use super::backstepping::Backstepping;
use super::pd::Pd;
use super::sliding_mode::SlidingMode;
use super::types::{ControllerError, Feedforward, Reference, State};
use crate::controller::backstepping;
use crate::controller::pd;
use crate::controller::sliding_mode;

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
