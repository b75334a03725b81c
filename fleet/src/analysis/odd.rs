//! Units that differ from the others.

use super::pooled::Pooled;
use super::statistics::{median, robust_deviation, two_sided};

/// Units that a comparison takes, at the least.
pub const LEAST: usize = 8;

/// A unit beside the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Beside {
    /// The unit.
    pub unit: String,
    /// Its own value.
    pub value: f64,
    /// Median of the units.
    pub fleet: f64,
    /// 95 % interval of the difference.
    pub interval: [f64; 2],
    /// Probability of a difference as large as this of a unit like the others.
    pub p: f64,
}

/// Compares each unit's own value with the median of all; the spread of the fleet is the one of its middle, which odd units do not widen.
pub fn beside(pooled: &Pooled) -> Vec<Beside> {
    let own: Vec<f64> = pooled.units.values().map(|unit| unit.own).collect();
    if own.len() < LEAST {
        return Vec::new();
    }
    let (fleet, spread) = (median(&own), robust_deviation(&own));
    let free = own.len() as f64 - 1.0;
    let of = |(name, unit): (&String, &super::pooled::OfUnit)| {
        // The robust spread has the errors of the units in it; of one that is less certain than most its own error counts in full.
        let sd = spread.hypot(unit.own_sd).max(f64::MIN_POSITIVE);
        let half = super::statistics::t_975(free) * unit.own_sd;
        let off = unit.own - fleet;
        Beside { unit: name.clone(), value: unit.own, fleet, interval: [off - half, off + half], p: two_sided(off / sd, free) }
    };
    pooled.units.iter().map(of).collect()
}
