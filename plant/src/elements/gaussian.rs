//! How the level of dry friction goes from rest to speed.

/// `kinetic + (at_rest - kinetic) exp(-ratio²)`, N: Stribeck's curve in its Gaussian form, `ratio` the speed over that at which the difference
/// has fallen to 1/e.
#[inline]
pub(super) fn between_rest_and_speed(at_rest: f64, kinetic: f64, ratio: f64) -> f64 {
    kinetic + (at_rest - kinetic) * (-ratio * ratio).exp()
}
