//! The sine at which a law that is not linear is evaluated.

/// How dry (set-valued) friction enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DryFriction {
    /// Not at all: everything slides freely.
    #[default]
    Ignored,
    /// As the damper that takes as much energy per cycle at the operating amplitude and frequency.
    Viscous,
}

/// `x = about + amplitude sin(2 pi f t)` across an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sine {
    /// m.
    pub about: f64,
    /// m, above 0.
    pub amplitude: f64,
    /// Hz, above 0.
    pub frequency_hz: f64,
    /// How dry friction enters.
    pub friction: DryFriction,
}
