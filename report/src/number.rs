//! Numbers as a reader wants them, the same in every report: three significant digits, SI prefixes.

/// Powers of ten and their prefixes. Micro is U+00B5, which every keyboard and font has.
const PREFIXES: [(i32, &str); 11] =
    [(-15, "f"), (-12, "p"), (-9, "n"), (-6, "µ"), (-3, "m"), (0, ""), (3, "k"), (6, "M"), (9, "G"), (12, "T"), (15, "P")];

/// What is written for a number that is not there.
const MISSING: &str = "–";

/// A number with three significant digits: `1.23`, `0.00123`, `12300`, `1.23e-9` below 1e-4 and from 1e6 on; `–` for NaN.
pub fn number(value: f64) -> String {
    if let Some(word) = not_finite(value) {
        return word;
    }
    let (digits, exponent) = three_digits(value);
    if value == 0.0 || (-4..6).contains(&exponent) { fixed(digits, exponent) } else { format!("{}e{exponent}", fixed(digits, 0)) }
}

/// A value with three significant digits and its unit with an SI prefix: `si(0.00123, "m")` is `1.23 mm`. A unit that takes no prefix
/// (none, %, dB, °, kg, powers such as m², 1/s) keeps its number, and so does one with an unusual prefix: `0.82 Hz`, `13700 rad/s`. `–` for NaN.
pub fn si(value: f64, unit: &str) -> String {
    if let Some(word) = not_finite(value) {
        return if value.is_nan() { word } else { join(&word, "", unit) };
    }
    if value == 0.0 || !takes_prefix(unit) {
        return join(&number(value), "", unit);
    }
    let (digits, exponent) = three_digits(value);
    let power = exponent.div_euclid(3) * 3;
    match PREFIXES.iter().find(|p| p.0 == power && is_usual(power, unit)) {
        Some(&(power, prefix)) => join(&fixed(digits, exponent - power), prefix, unit),
        None => join(&number(value), "", unit),
    }
}

/// A share as a percentage with three significant digits: `percent(0.1234)` is `12.3 %`; `–` for NaN.
pub fn percent(share: f64) -> String {
    if share.is_nan() { MISSING.into() } else { format!("{} %", number(share * 100.0)) }
}

/// The power of ten (a multiple of three) and the prefix by which an axis whose largest value is `largest` is labelled. Without a prefix
/// the power may stand alone.
pub fn axis_scale(largest: f64, unit: &str) -> (i32, Option<&'static str>) {
    if !largest.is_finite() || largest <= 0.0 {
        return (0, None);
    }
    let exponent = largest.log10().floor() as i32;
    // Up to 5 digits before the point and one zero behind it are still easily read.
    let power = if takes_prefix(unit) {
        if (0..4).contains(&exponent) { 0 } else { exponent.div_euclid(3) * 3 }
    } else if (-2..5).contains(&exponent) {
        0
    } else {
        exponent.div_euclid(3) * 3
    };
    if power == 0 || unit == "dB" || unit == "°" || unit == "%" {
        return (0, None);
    }
    if takes_prefix(unit) && !is_usual(power, unit) {
        return if (-2..5).contains(&exponent) { (0, None) } else { (power, None) };
    }
    match PREFIXES.iter().find(|p| p.0 == power && takes_prefix(unit)) {
        Some(&(_, prefix)) => (power, Some(prefix)),
        None => (power, None),
    }
}

/// A power of ten with its exponent set high: `10⁻³`.
pub fn power_of_ten(exponent: i32) -> String {
    let digits = exponent.unsigned_abs().to_string();
    let high = digits.chars().filter_map(|c| c.to_digit(10)).filter_map(|d| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(d as usize));
    let sign = if exponent < 0 { "⁻" } else { "" };
    format!("10{sign}{}", high.collect::<String>())
}

/// The part of a unit that a prefix would join: `N` of `N s/m`.
fn first_unit(unit: &str) -> &str {
    unit.split([' ', '/', '·', '*']).next().unwrap_or("")
}

/// Whether a prefix before this unit means what the reader thinks: not before `m²` (mm² is not a thousandth), `kg`, `1/s`.
fn takes_prefix(unit: &str) -> bool {
    matches!(first_unit(unit), "m" | "s" | "N" | "Nm" | "J" | "W" | "Hz" | "V" | "A" | "g" | "Pa" | "rad" | "Ω" | "F" | "H" | "B")
}

/// Whether engineers use the prefix of a power with a unit: not ks, km, krad or mHz.
fn is_usual(power: i32, unit: &str) -> bool {
    match first_unit(unit) {
        "s" | "m" | "rad" => power <= 0,
        "Hz" => power >= 0,
        _ => true,
    }
}

fn not_finite(value: f64) -> Option<String> {
    if value.is_nan() {
        Some(MISSING.into())
    } else if value.is_infinite() {
        Some(if value > 0.0 { "∞" } else { "-∞" }.into())
    } else {
        None
    }
}

/// Three significant digits as a signed integer of magnitude 100..=999, and the decimal exponent of the first one. Rounded by the
/// standard library, so 999.6 is 100 with exponent 3.
fn three_digits(value: f64) -> (i32, i32) {
    let text = format!("{value:.2e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let digits: String = mantissa.chars().filter(|c| *c != '.').collect();
    (digits.parse().unwrap_or(0), exponent.parse().unwrap_or(0))
}

/// Three digits written out with the first one at 10^exponent.
fn fixed(digits: i32, exponent: i32) -> String {
    if digits == 0 {
        return "0".into();
    }
    let sign = if digits < 0 { "-" } else { "" };
    let digits = digits.abs().to_string();
    let point = exponent + 1; // digits before the point
    let text = if point <= 0 {
        format!("0.{}{digits}", "0".repeat(point.unsigned_abs() as usize))
    } else if (point as usize) < digits.len() {
        let (whole, rest) = digits.split_at(point as usize);
        format!("{whole}.{rest}")
    } else {
        format!("{digits}{}", "0".repeat(point as usize - digits.len()))
    };
    format!("{sign}{text}")
}

fn join(number: &str, prefix: &str, unit: &str) -> String {
    if unit.is_empty() { number.to_string() } else { format!("{number} {prefix}{unit}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_significant_digits_with_prefix() {
        for (value, unit, text) in [
            (0.00123, "m", "1.23 mm"),
            (-0.00123, "m", "-1.23 mm"),
            (0.0009996, "m", "1.00 mm"),
            (999.6, "N", "1.00 kN"),
            (12.0, "N", "12.0 N"),
            (39_500.0, "N/m", "39.5 kN/m"),
            (2.5e-7, "J", "250 nJ"),
            (1200.0, "s", "1200 s"),
            (0.818, "Hz", "0.818 Hz"),
            (1500.0, "Hz", "1.50 kHz"),
            (13_700.0, "rad/s", "13700 rad/s"),
            (0.0137, "rad", "13.7 mrad"),
            (0.02, "s", "20.0 ms"),
            (0.01076, "kg", "0.0108 kg"),
            (3e-6, "m²", "3.00e-6 m²"),
            (0.0, "m", "0 m"),
            (1e-20, "m", "1.00e-20 m"),
            (f64::NAN, "m", "–"),
            (f64::INFINITY, "N", "∞ N"),
            (5.0, "", "5.00"),
        ] {
            assert_eq!(si(value, unit), text, "{value} {unit}");
        }
    }

    #[test]
    fn plain_numbers_and_shares() {
        for (value, text) in
            [(1.2345, "1.23"), (123_456.0, "123000"), (1e6, "1.00e6"), (-0.05, "-0.0500"), (9.999e-5, "0.000100"), (9e-5, "9.00e-5")]
        {
            assert_eq!(number(value), text);
        }
        assert_eq!(percent(0.1234), "12.3 %");
        assert_eq!(percent(1.0), "100 %");
        assert_eq!(percent(f64::NAN), "–");
    }

    #[test]
    fn axes_are_labelled_by_prefix_or_power() {
        assert_eq!(axis_scale(0.004, "m"), (-3, Some("m")));
        assert_eq!(axis_scale(5000.0, "Hz"), (0, None));
        assert_eq!(axis_scale(50_000.0, "N/m"), (3, Some("k")));
        assert_eq!(axis_scale(3e-5, ""), (-6, None));
        assert_eq!(axis_scale(3e4, "s"), (0, None));
        assert_eq!(axis_scale(3e9, "s"), (9, None));
        assert_eq!(axis_scale(0.5, "Hz"), (0, None));
        assert_eq!(axis_scale(13_700.0, "rad/s"), (0, None));
        assert_eq!(power_of_ten(-12), "10⁻¹²");
    }
}
