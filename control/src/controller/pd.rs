//! Proportional and derivative action.

use super::{AxisModel, Reference, State};

/// Gains of [`Pd`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// N/m or N m/rad, at least 0.
    pub stiffness: f64,
    /// N s/m or N m s/rad, at least 0.
    pub damping: f64,
}

/// `u = stiffness (q_r - q) + damping (q_r' - q')`, and the model's friction along the reference where there is a model.
#[derive(Debug, Clone)]
pub struct Pd {
    gains: Gains,
    friction: Option<AxisModel>,
    /// The reference of the step before.
    before: Option<f64>,
}

impl Pd {
    /// With the friction of `friction` fed forward, where given.
    pub fn new(gains: Gains, friction: Option<AxisModel>) -> Pd {
        Pd { gains, friction, before: None }
    }

    /// Force on the motor, N or N m.
    pub fn effort(&mut self, reference: &Reference, state: &State, period_s: f64) -> f64 {
        let fed = self.friction.as_mut().map_or(0.0, |model| feed(model, &mut self.before, reference, period_s));
        self.gains.stiffness * (reference.position - state.position) + self.gains.damping * (reference.velocity - state.velocity) + fed
    }
}

/// The friction that a model has on the reference's path.
pub(super) fn feed(model: &mut AxisModel, before: &mut Option<f64>, reference: &Reference, period_s: f64) -> f64 {
    let from = before.replace(reference.position).unwrap_or(0.0);
    model.advance(from, reference.position, period_s);
    model.friction(reference.velocity)
}
