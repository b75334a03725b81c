//! An input between two samples.

/// An input over one period: `c0 + c1 s + c2 s² + c3 s³`, s the time since the sample, s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Segment {
    /// Rising powers of s.
    pub c: [f64; 4],
}

impl Segment {
    /// The same value throughout.
    pub fn held(value: f64) -> Segment {
        Segment { c: [value, 0.0, 0.0, 0.0] }
    }

    /// A straight line that takes `period` seconds.
    pub fn line(from: f64, to: f64, period: f64) -> Segment {
        Segment { c: [from, (to - from) / period, 0.0, 0.0] }
    }

    /// Whether it stays at its first value.
    #[inline]
    pub fn is_held(&self) -> bool {
        self.c[1] == 0.0 && self.c[2] == 0.0 && self.c[3] == 0.0
    }

    /// Value at `s`.
    #[inline]
    pub fn value(&self, s: f64) -> f64 {
        let [c0, c1, c2, c3] = self.c;
        c0 + s * (c1 + s * (c2 + s * c3))
    }

    /// Rate of change at `s`.
    #[inline]
    pub fn slope(&self, s: f64) -> f64 {
        let [_, c1, c2, c3] = self.c;
        c1 + s * (2.0 * c2 + s * 3.0 * c3)
    }

    /// Second derivative at `s`.
    #[inline]
    pub fn curvature(&self, s: f64) -> f64 {
        2.0 * self.c[2] + 6.0 * self.c[3] * s
    }
}
