//! The exponential of hysteresis updates.

/// exp(-a) for `a >= 0`, to 1e-16. A substep moves little against the length over which a memory settles, so `a` is
/// mostly small, and then a few terms are quicker than the library.
#[inline]
pub(super) fn decay(a: f64) -> f64 {
    if a > 0.125 {
        return (-a).exp();
    }
    let terms = 1.0 / 40320.0 - a * (1.0 / 362_880.0 - a * (1.0 / 3_628_800.0));
    let terms = 1.0 / 720.0 - a * (1.0 / 5040.0 - a * terms);
    1.0 - a * (1.0 - a * (0.5 - a * (1.0 / 6.0 - a * (1.0 / 24.0 - a * (1.0 / 120.0 - a * terms)))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_library() {
        for i in 0..4000 {
            let a = 1e-4 * f64::from(i);
            assert!((decay(a) / (-a).exp() - 1.0).abs() < 4e-16, "{a}");
        }
        assert_eq!(decay(0.0), 1.0);
    }
}
