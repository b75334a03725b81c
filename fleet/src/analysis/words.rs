//! Changes and odd units in sentences.

use super::change::Shape;
use super::types::{Change, Odd};
use crate::date::Date;
use crate::parameter::Parameter;

/// A level that is larger than this many half widths of the change's interval can be compared with in percent.
const CERTAIN: f64 = 1.0;

/// "unit 17, elbow: dry friction +18 % since 3 November 2026 (95 %: 11 to 25 %)".
pub fn sentence_of_change(change: &Change, parameter: Parameter, is_servo: bool) -> String {
    let day = |text: &str| Date::parse(text).map_or_else(|| text.to_string(), Date::words);
    let who = named(&change.unit);
    let rises = match change.shape {
        Shape::Step => "since",
        Shape::Ramp => "in steady drift since",
    };
    let size = amount(change.effect, change.ci95, change.before, parameter, is_servo);
    format!(
        "{who}, {}: {} {size} {rises} {}{}",
        change.joint,
        parameter.said(is_servo),
        day(&change.since),
        interval(change, parameter, is_servo)
    )
}

fn interval(change: &Change, parameter: Parameter, is_servo: bool) -> String {
    let [low, high] = change.ci95;
    match of_level(change.ci95, change.before, parameter) {
        true => {
            let percent = |x: f64| 100.0 * x / change.before.abs();
            format!(" (95 %: {:.0} to {:.0} %)", percent(low), percent(high))
        }
        false => format!(" (95 %: {} to {} {})", digits(low), digits(high), parameter.unit(is_servo)),
    }
}

/// A change with its sign: in percent of the level before, where that level is certain; else in the parameter's unit.
pub fn amount(effect: f64, ci95: [f64; 2], before: f64, parameter: Parameter, is_servo: bool) -> String {
    match of_level(ci95, before, parameter) {
        true => format!("{:+.0} %", 100.0 * effect / before.abs()),
        false => format!("{}{} {}", if effect >= 0.0 { "+" } else { "-" }, digits(effect.abs()), parameter.unit(is_servo)),
    }
}

/// Whether percents mean something: of friction and inertia, which are never below 0, and a level well above its error.
fn of_level(ci95: [f64; 2], before: f64, parameter: Parameter) -> bool {
    ["dry", "viscous", "inertia", "delay", "lost_motion"].contains(&parameter.name) && before > CERTAIN * 0.5 * (ci95[1] - ci95[0])
}

/// Three significant digits.
fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let place = value.abs().log10().floor() as i32;
    match place {
        -3..=5 => format!("{value:.*}", (2 - place).clamp(0, 6) as usize),
        _ => format!("{value:.2e}"),
    }
}

/// A unit as a reader calls it.
fn named(unit: &str) -> String {
    let is_named = unit == "all units" || unit.to_lowercase().starts_with("unit");
    if is_named { unit.to_string() } else { format!("unit {unit}") }
}

/// "unit 17, elbow: dry friction 3.1 N m, where the fleet has 1.2 N m".
pub fn sentence_of_odd(odd: &Odd, parameter: Parameter, is_servo: bool) -> String {
    let unit = parameter.unit(is_servo);
    format!(
        "{}, {}: {} {} {unit}, where the fleet has {} {unit} (95 % of the difference: {} to {})",
        named(&odd.unit),
        odd.joint,
        parameter.said(is_servo),
        digits(odd.value),
        digits(odd.fleet),
        digits(odd.ci95[0]),
        digits(odd.ci95[1])
    )
}
