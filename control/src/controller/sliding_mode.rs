//! Sliding mode with a reaching law: Gao & Hung 1993, and Choi, Han & Kim 2006, eqs (26) and (32).

use super::pd::feed;
use super::{AxisModel, Feedforward, Reference, State, switching_sign};

/// Gains of [`SlidingMode`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// λ of the surface `S = e' + λ e`, 1/s, at least 0.
    pub surface: f64,
    /// D of `S' = -D S - K sgn S`, 1/s, at least 0.
    pub reaching: f64,
    /// K, m/s² or rad/s², at least 0.
    pub switching: f64,
    /// Width of the layer in which sgn is a straight line, m/s or rad/s; 0 for none.
    pub boundary: f64,
}

/// `u = J (q_r'' + λ e' + D S + K sgn S)`, and the model's friction along the reference where it is fed forward.
#[derive(Debug, Clone)]
pub struct SlidingMode {
    gains: Gains,
    model: AxisModel,
    feedforward: Feedforward,
    before: Option<f64>,
}

impl SlidingMode {
    /// For an axis as `model` has it.
    pub fn new(gains: Gains, model: AxisModel, feedforward: Feedforward) -> SlidingMode {
        SlidingMode { gains, model, feedforward, before: None }
    }

    /// S, m/s or rad/s.
    pub fn surface(&self, reference: &Reference, state: &State) -> f64 {
        reference.velocity - state.velocity + self.gains.surface * (reference.position - state.position)
    }

    /// Force on the motor, N or N m.
    pub fn effort(&mut self, reference: &Reference, state: &State, period_s: f64) -> f64 {
        let Gains { surface: slope, reaching, switching, boundary } = self.gains;
        let surface = self.surface(reference, state);
        let rate = reaching * surface + switching * switching_sign(surface, boundary);
        let fed = match self.feedforward {
            Feedforward::None => 0.0,
            Feedforward::Friction => feed(&mut self.model, &mut self.before, reference, period_s),
        };
        self.model.inertia * (reference.acceleration + slope * (reference.velocity - state.velocity) + rate) + fed
    }
}
