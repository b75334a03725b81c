//! What every law is given, and why there may be none.

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

/// Why a controller cannot be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ControllerError {
    /// The law needs values that only a model provides.
    #[error("law \"{law}\" needs a model with the inertia and friction of the axis")]
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
