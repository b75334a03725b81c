//! Limits and ticks of an axis.

use crate::number::{axis_scale, power_of_ten};
use crate::plot::Axis;

/// Beyond this magnitude a value counts as not finite: differences and products of such values would overflow.
const HUGE: f64 = 1e150;

/// Whether a value can stand on this axis at all.
pub fn drawable(value: f64, log: bool) -> bool {
    value.abs() < HUGE && (!log || value > 1.0 / HUGE)
}

/// A drawn axis: its limits, and how a value becomes a share of its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    pub lo: f64,
    pub hi: f64,
    pub log: bool,
}

impl Scale {
    /// Where the value lies: 0 at the lower limit, 1 at the upper one; NaN if it cannot stand on this axis.
    pub fn share(&self, value: f64) -> f64 {
        if !drawable(value, self.log) {
            f64::NAN
        } else if self.log {
            (value / self.lo).ln() / (self.hi / self.lo).ln()
        } else {
            (value - self.lo) / (self.hi - self.lo)
        }
    }

    pub fn holds(&self, value: f64) -> bool {
        drawable(value, self.log) && value >= self.lo && value <= self.hi
    }
}

/// The limits of an axis: the fixed ones if they make an axis, else all values with `air` (a share of the span) at both ends.
pub fn limits(axis: &Axis, values: impl Iterator<Item = f64>, air: f64) -> Scale {
    let log = axis.log;
    if let Some((a, b)) = axis.limits {
        let (lo, hi) = (a.min(b), a.max(b));
        if drawable(lo, log) && drawable(hi, log) && wide_enough(lo, hi) {
            return Scale { lo, hi, log };
        }
    }
    let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
    for v in values.chain(axis.include.iter().copied()).filter(|v| drawable(*v, log)) {
        lo = lo.min(v);
        hi = hi.max(v);
    }
    if lo > hi {
        return if log { Scale { lo: 0.1, hi: 10.0, log } } else { Scale { lo: 0.0, hi: 1.0, log } };
    }
    if !wide_enough(lo, hi) {
        // One value, or many alike: a window of a tenth, or of a factor of two on a logarithmic axis.
        return if log {
            Scale { lo: lo / 2.0, hi: hi * 2.0, log }
        } else {
            let half = if lo.abs().max(hi.abs()) > 1.0 / HUGE { lo.abs().max(hi.abs()) * 0.1 } else { 1.0 };
            Scale { lo: lo - half, hi: hi + half, log }
        };
    }
    if log {
        let factor = (hi / lo).powf(air);
        Scale { lo: lo / factor, hi: hi * factor, log }
    } else {
        let more = (hi - lo) * air;
        Scale { lo: lo - more, hi: hi + more, log }
    }
}

/// Whether the span is more than the rounding of its ends.
fn wide_enough(lo: f64, hi: f64) -> bool {
    hi - lo > 1e-11 * lo.abs().max(hi.abs())
}

/// A place on an axis; minor ones have no label.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    pub at: f64,
    pub label: Option<String>,
}

/// The ticks of an axis and what its label says behind the name: `mm`, `×10⁻³ 1/s`, or nothing.
pub struct Ticks {
    pub ticks: Vec<Tick>,
    pub unit: String,
}

/// Ticks for an axis with room for about `room` labels.
pub fn ticks(scale: &Scale, unit: &str, room: f64) -> Ticks {
    let decades = if scale.log { (scale.hi / scale.lo).log10() } else { 0.0 };
    if scale.log && decades > 0.7 {
        return Ticks { ticks: log_ticks(scale, decades, room), unit: unit.to_string() };
    }
    let (power, prefix) = axis_scale(scale.lo.abs().max(scale.hi.abs()), unit);
    let factor = 10f64.powi(power);
    let unit = match prefix {
        Some(prefix) => format!("{prefix}{unit}"),
        None if power == 0 => unit.to_string(),
        None => format!("×{} {unit}", power_of_ten(power)).trim_end().to_string(),
    };
    let circle = unit == "°" || unit == "deg";
    let step = step((scale.hi - scale.lo) / factor, room, circle);
    let decimals = (-(step.log10() + 1e-9).floor()).clamp(0.0, 15.0) as usize;
    let (first, last) = ((scale.lo / factor / step - 1e-9).ceil(), (scale.hi / factor / step + 1e-9).floor());
    let count = if last >= first { ((last - first) as usize).min(200) + 1 } else { 0 };
    let ticks = (0..count)
        .map(|i| {
            let shown = (first + i as f64) * step;
            Tick { at: shown * factor, label: Some(decimal(shown, decimals)) }
        })
        .collect();
    Ticks { ticks, unit }
}

/// The least of 1, 2, 5 times a power of ten (of a part of the circle, above 2°) that gives at most `room` intervals.
fn step(span: f64, room: f64, circle: bool) -> f64 {
    let least = span / room.max(1.0);
    if circle && let Some(part) = [5.0, 10.0, 15.0, 30.0, 45.0, 90.0, 180.0, 360.0].into_iter().find(|p| *p >= least && least > 2.0) {
        return part;
    }
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= least * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

/// Decades with labels, as many as there is room for, with 2 and 5 between them where they are few; the rest minor.
fn log_ticks(scale: &Scale, decades: f64, room: f64) -> Vec<Tick> {
    let (first, last) = (scale.lo.log10().floor() as i32, scale.hi.log10().ceil() as i32);
    let every = (decades / room.max(1.0)).ceil().max(1.0) as i32;
    let between: &[u32] = match decades * 3.0 {
        labels if labels <= room && decades < 3.0 => &[1, 2, 5],
        _ if decades * 2.0 <= room && decades < 2.0 => &[1, 3],
        _ => &[1],
    };
    let mut ticks = Vec::new();
    for power in first..=last {
        for digit in 1..10u32 {
            let at = f64::from(digit) * 10f64.powi(power);
            let inside = at >= scale.lo * (1.0 - 1e-9) && at <= scale.hi * (1.0 + 1e-9);
            let labelled = between.contains(&digit) && power.rem_euclid(every) == 0;
            if inside && (labelled || (every == 1 && decades < 8.0) || digit == 1) {
                ticks.push(Tick { at, label: labelled.then(|| log_label(digit, power, scale)) });
            }
        }
    }
    ticks
}

fn log_label(digit: u32, power: i32, scale: &Scale) -> String {
    // Plain numbers where all of them are short, powers of ten otherwise: one way per axis.
    if scale.lo >= 0.9e-3 && scale.hi <= 2e5 {
        decimal(f64::from(digit) * 10f64.powi(power), power.min(0).unsigned_abs() as usize)
    } else if digit == 1 {
        power_of_ten(power)
    } else {
        format!("{digit}·{}", power_of_ten(power))
    }
}

/// A decimal with a true minus sign; never "−0".
fn decimal(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_string(),
        Some(rest) => format!("−{rest}"),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(lo: f64, hi: f64, log: bool, unit: &str, room: f64) -> (Vec<String>, String) {
        let t = ticks(&Scale { lo, hi, log }, unit, room);
        (t.ticks.into_iter().filter_map(|t| t.label).collect(), t.unit)
    }

    #[test]
    fn linear_ticks_are_round_and_carry_the_prefix() {
        assert_eq!(labels(-0.0031, 0.0042, false, "m", 5.0), (vec!["−2".into(), "0".into(), "2".into(), "4".into()], "mm".into()));
        assert_eq!(labels(0.0, 1.0, false, "", 5.0).0, ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(-270.0, 10.0, false, "°", 5.0).0, ["−270", "−180", "−90", "0"]);
        assert_eq!(labels(0.0, 3e-5, false, "1/s", 4.0), (vec!["0".into(), "10".into(), "20".into(), "30".into()], "×10⁻⁶ 1/s".into()));
    }

    #[test]
    fn ticks_far_from_zero_keep_their_digits() {
        assert_eq!(labels(1000.0001, 1000.0005, false, "", 4.0).0, ["1000.0001", "1000.0002", "1000.0003", "1000.0004", "1000.0005"]);
    }

    #[test]
    fn logarithmic_ticks_thin_out_with_the_room() {
        assert_eq!(labels(0.1, 50.0, true, "", 12.0).0, ["0.1", "0.2", "0.5", "1", "2", "5", "10", "20", "50"]);
        assert_eq!(labels(0.1, 50.0, true, "", 4.0).0, ["0.1", "1", "10"]);
        assert_eq!(labels(1e-9, 1e3, true, "m", 4.0).0, ["10⁻⁹", "10⁻⁶", "10⁻³", "10⁰", "10³"]);
        // Half a decade: linear numbers on the logarithmic axis.
        assert_eq!(labels(2.0, 6.0, true, "Hz", 5.0).0, ["2", "3", "4", "5", "6"]);
    }

    #[test]
    fn limits_of_odd_data_still_make_an_axis() {
        let axis = |log| Axis { log, ..Axis::default() };
        for (log, values) in [
            (false, vec![]),
            (true, vec![]),
            (false, vec![f64::NAN, f64::INFINITY]),
            (false, vec![0.0; 3]),
            (false, vec![-7.0; 3]),
            (false, vec![1e-300, 2e-300]),
            (false, vec![f64::MAX, f64::MIN]),
            (true, vec![0.0, -1.0]),
            (true, vec![3.0]),
            (true, vec![1e-300, 1e300]),
            (false, vec![1.0, 1.0 + 1e-15]),
        ] {
            let scale = limits(&axis(log), values.iter().copied(), 0.05);
            assert!(scale.lo < scale.hi && scale.lo.is_finite() && scale.hi.is_finite(), "{values:?}: {scale:?}");
            let found = ticks(&scale, "m", 6.0).ticks;
            assert!(!found.is_empty() && found.len() < 250, "{values:?}: {} ticks", found.len());
            for v in values.iter().filter(|v| drawable(**v, log)) {
                assert!((0.0..=1.0).contains(&scale.share(*v)), "{v} in {scale:?}");
            }
        }
        let fixed = Axis { limits: Some((f64::NAN, 1.0)), ..Axis::default() };
        assert_eq!(limits(&fixed, [2.0, 4.0].into_iter(), 0.0), Scale { lo: 2.0, hi: 4.0, log: false });
    }
}
