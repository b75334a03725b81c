//! What the energies of an axis say of its stability.

use super::types::{AxisEnergy, EnergyVerdict, Trend};

pub(super) fn judge(axis: &mut AxisEnergy, beyond_j: Option<f64>, touched: bool) {
    const MAY_REST: &str = "passivity is sufficient for stability, not necessary: friction may still bring the master to rest";
    let friction: f64 = axis.elements.iter().filter(|e| e.friction).filter_map(|e| e.hold_w).sum();
    let gives = |hold: &Trend| hold.mean_w + hold.half_width_w < 0.0 && -hold.mean_w * axis.hold_s > axis.master.rounding_j;
    (axis.verdict, axis.reason) = match (touched, axis.master.hold, beyond_j) {
        (false, ..) => (EnergyVerdict::CannotTell, "there was no contact".to_owned()),
        (_, Some(hold), _) if gives(&hold) => {
            let all: f64 = axis.elements.iter().filter_map(|e| e.hold_w).sum();
            let taken = if all > 0.0 {
                format!(
                    " (by the model its elements dissipate {} there, {} of it in dry friction and hysteresis)",
                    in_unit(all, "W"),
                    in_unit(friction, "W")
                )
            } else {
                String::new()
            };
            let power = -hold.mean_w;
            (
                EnergyVerdict::Active,
                format!("the displayed environment delivers {} while the hand holds still{taken}; {MAY_REST}", in_unit(power, "W")),
            )
        }
        (_, Some(_), None) => {
            let reason = "the displayed environment is passive, and delivers no energy while the hand holds still";
            (EnergyVerdict::Passive, reason.to_owned())
        }
        (_, hold, beyond) => {
            let gave = beyond.map_or("never delivered more energy than it received".to_owned(), |j| {
                format!("at times delivered {} more than it received", in_unit(j, "J"))
            });
            let held = if hold.is_some() { "delivers none while the hand holds still" } else { "the hand never held still in contact" };
            (EnergyVerdict::CannotTell, format!("the displayed environment {gave}, but {held}; {MAY_REST}"))
        }
    };
}

/// A power or an energy with three digits and the prefix that suits it.
fn in_unit(value: f64, unit: &str) -> String {
    let (factor, prefix) = match value.abs() {
        x if x >= 1.0 => (1.0, ""),
        x if x >= 1e-3 => (1e3, "m"),
        _ => (1e6, "µ"),
    };
    format!("{:.3} {prefix}{unit}", factor * value)
}
