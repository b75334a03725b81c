//! Physics and places in words, from one table: what headlines, texts and pages say in place of ids.

use crate::physics::physics_named;
use serde_json::Value;

/// A physics in words; its name with spaces where the table has none.
pub fn physics(name: &str) -> String {
    physics_named(name).map_or_else(|| name.replace('_', " "), |p| p.words.to_string())
}

/// Where a finding of a verdict sits, in words: `at the motor`, `between motor and drum`, `at the input or output force`.
pub fn place(finding: &Value) -> String {
    let ends: Vec<&str> = finding["between"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    match (ends.as_slice(), finding["signal"].as_str()) {
        ([body, "ground"] | ["ground", body], _) => format!("at the {body}"),
        ([a, b], _) => format!("between {a} and {b}"),
        (_, Some(signal)) => format!("at the signal {signal}"),
        _ => String::new(),
    }
}

/// A finding of a verdict in words: `backlash between motor and drum, 0.31 mm`.
pub fn finding(finding: &Value) -> String {
    let name = finding["physics"].as_str().unwrap_or("");
    let size = physics_named(name).and_then(|p| sized(&finding["parameters"][p.size])).map_or(String::new(), |s| format!(", {s}"));
    format!("{} {}{size}", physics(name), place(finding))
}

/// What explanations that cannot be told apart have in common, and where they differ: `dry friction, at the motor or at the drum`.
pub fn any_of(all: &[&Value]) -> String {
    let names: Vec<&str> = all.iter().filter_map(|f| f["physics"].as_str()).collect();
    let unique = |items: Vec<String>| {
        let mut seen: Vec<String> = Vec::new();
        items.into_iter().for_each(|i| {
            if !seen.contains(&i) {
                seen.push(i)
            }
        });
        seen.join(" or ")
    };
    let family = |name: &str| physics_named(name)?.family.words();
    let kin = names.first().and_then(|n| family(n)).filter(|first| names.iter().all(|n| family(n) == Some(first)));
    match kin {
        Some(kin) => format!("{kin}, {}", unique(all.iter().map(|f| place(f)).collect())),
        None => unique(all.iter().map(|f| format!("{} {}", physics(f["physics"].as_str().unwrap_or("")), place(f))).collect()),
    }
}

/// A parameter of a verdict with three digits and its unit; `None` for a list.
fn sized(parameter: &Value) -> Option<String> {
    let (value, unit) = (parameter["value"].as_f64()?, parameter["unit"].as_str().unwrap_or(""));
    let prefixed = matches!(unit, "m" | "s" | "N" | "rad");
    let (scale, prefix) = match value.abs() {
        x if prefixed && x > 0.0 && x < 1e-3 && unit != "N" && x < 1e-4 => (1e6, "µ"),
        x if prefixed && x > 0.0 && x < 0.1 => (1e3, "m"),
        _ => (1.0, ""),
    };
    let number = backdrive_plant::write::round_significant(value * scale, 3);
    Some(format!("{number} {prefix}{unit}").trim_end().to_string())
}

/// A share as a reader takes it: `97 %`, `below 0.1 %`, `above 99.9 %`.
pub fn share(value: f64) -> String {
    match value {
        v if !v.is_finite() => "unknown".to_string(),
        v if v < 1e-3 => "below 0.1 %".to_string(),
        v if v > 0.999 => "above 99.9 %".to_string(),
        v => format!("{} %", backdrive_plant::write::round_significant(100.0 * v, 2)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_finding_reads_in_words() {
        let gap =
            json!({ "physics": "backlash", "between": ["motor", "drum"], "parameters": { "gap": { "value": 0.00031, "unit": "m" } } });
        assert_eq!(finding(&gap), "backlash between motor and drum, 0.31 mm");
        let at = |body: &str, physics: &str| json!({ "physics": physics, "between": [body, "ground"] });
        let (motor, drum) = (at("motor", "coulomb"), at("drum", "dahl"));
        assert_eq!(any_of(&[&motor, &drum]), "dry friction, at the motor or at the drum");
        let lag = json!({ "physics": "delay", "signal": "force" });
        assert_eq!(any_of(&[&motor, &lag]), "dry friction at the motor or a delay at the signal force");
    }

    #[test]
    fn a_share_has_no_exponent() {
        assert_eq!([5.05e-123, 0.04, 0.97, 0.9999].map(share), ["below 0.1 %", "4 %", "97 %", "above 99.9 %"]);
    }
}
