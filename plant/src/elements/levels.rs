//! What the dry friction kinds share: the level of a set-valued law.

/// Level of dry friction against sliding speed, for each direction:
/// `level(v) = kinetic + (at_rest - kinetic) exp(-(v/velocity)²)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionLevels {
    /// Level at speed, N, for `v > 0` and `v < 0`.
    pub kinetic: [f64; 2],
    /// Level at rest, N, for a push towards `v > 0` and `v < 0`.
    pub at_rest: [f64; 2],
    /// Speed at which the difference has fallen to 1/e, m/s; 0 when the level does not depend on speed.
    pub velocity: f64,
}

impl FrictionLevels {
    /// The same level at every speed.
    pub fn constant(positive: f64, negative: f64) -> FrictionLevels {
        FrictionLevels { kinetic: [positive, negative], at_rest: [positive, negative], velocity: 0.0 }
    }

    /// Level while sliding at `v`, N, for `v > 0` (`side` 0) or `v < 0` (`side` 1).
    #[inline]
    pub fn sliding(&self, side: usize, v: f64) -> f64 {
        if self.velocity <= 0.0 {
            return self.kinetic[side];
        }
        let ratio = v / self.velocity;
        self.kinetic[side] + (self.at_rest[side] - self.kinetic[side]) * (-ratio * ratio).exp()
    }
}
