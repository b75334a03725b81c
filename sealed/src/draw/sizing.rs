//! How large drawn effects are, as shares of what the device does under its working force.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Share of the working force that dry friction takes. Below 3 % it is under the difference in force that a hand perceives (some 7 %, Jones 1989) and
/// little for a stability margin; above 15 % no one would call the device backdrivable.
pub(crate) const FRICTION: [f64; 2] = [0.03, 0.15];

/// Share of the working force that viscous and back-EMF forces take at the working speed: as friction, and somewhat more,
/// since they vanish where the device is slow.
pub(crate) const DRAG: [f64; 2] = [0.05, 0.25];

/// Share of the working force in a motor's ripple: a few per cent is usual, ten per cent poor.
pub(crate) const RIPPLE: [f64; 2] = [0.03, 0.12];

/// Log-uniform between the two.
pub(crate) fn between(low: f64, high: f64, random: &mut ChaCha8Rng) -> f64 {
    (low.ln() + (high / low).ln() * random.random_range(0.0..=1.0)).exp()
}

/// To four digits: a truth is read by people, and a short decimal comes back from its file as the same number.
pub(crate) fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Log-uniform within a range.
pub(crate) fn share(of: [f64; 2], random: &mut ChaCha8Rng) -> f64 {
    between(of[0], of[1], random)
}

/// m, the presliding displacement within which friction reaches its level: 1 to 15 % of the travel, which reversals show.
pub(crate) fn presliding(travel: f64, random: &mut ChaCha8Rng) -> f64 {
    travel * between(0.01, 0.15, random)
}
