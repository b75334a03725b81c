//! How the level of dry friction goes from rest to speed.

/// Level that goes from `at_rest` to `kinetic` as a Gaussian of the speed over its scale (Stribeck's curve in the form of Tustin and Armstrong).
pub(super) fn between_rest_and_speed(at_rest: f64, kinetic: f64, ratio: f64) -> f64 {
    kinetic + (at_rest - kinetic) * (-ratio * ratio).exp()
}
