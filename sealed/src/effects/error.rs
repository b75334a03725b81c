//! An effect that does not fit the device.

/// An effect that does not fit the device.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// The place or an element that the effect names is not there.
    #[error("effect \"{effect}\": the device has no {what} \"{name}\"; is this the truth of another device?")]
    Missing {
        /// Name of the effect.
        effect: &'static str,
        /// `body`, `element`, `force input` or `joint`.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// The effect needs another sort of place.
    #[error("effect \"{effect}\" cannot sit there: it needs {needed}")]
    WrongSite {
        /// Name of the effect.
        effect: &'static str,
        /// `two bodies`, `a body and ground` or `a force input`.
        needed: &'static str,
    },
    /// A number is out of range.
    #[error("effect \"{effect}\": {key} = {value} is out of range, expected {expected}")]
    Number {
        /// Name of the effect.
        effect: &'static str,
        /// The number's name.
        key: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
}
