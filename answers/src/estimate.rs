//! A parameter of a servo joint with its interval, for terminal and page.

use backdrive_diagnosis::verdict::Estimate;
use backdrive_report::{number, si};

/// A parameter with its interval.
pub fn estimate(estimate: &Estimate) -> String {
    let Estimate { value, unit, ci95, .. } = estimate;
    let with_unit = |x: f64| if matches!(unit.as_str(), "rad" | "s" | "N m") { si(x, unit) } else { format!("{} {unit}", number(x)) };
    match ci95 {
        [Some(low), Some(high)] => format!("{} (95 %: {} to {})", with_unit(*value), with_unit(*low), with_unit(*high)),
        _ => with_unit(*value),
    }
}
