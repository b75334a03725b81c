//! What a number may be.

/// What a number may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Allowed {
    /// Any finite number.
    Any,
    /// At least 0.
    NotNegative,
    /// Above 0.
    Positive,
    /// At least 1.
    One,
}

impl Allowed {
    pub fn holds(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Allowed::Any => true,
                Allowed::NotNegative => value >= 0.0,
                Allowed::Positive => value > 0.0,
                Allowed::One => value >= 1.0,
            }
    }

    pub fn words(self) -> &'static str {
        match self {
            Allowed::Any => "a finite number",
            Allowed::NotNegative => "a finite number of at least 0",
            Allowed::Positive => "a finite number above 0",
            Allowed::One => "a finite number of at least 1",
        }
    }
}
