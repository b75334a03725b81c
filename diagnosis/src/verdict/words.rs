//! Physics and places in words, from one table: what headlines, texts and pages say in place of ids.

use crate::hypothesis::Place;
use crate::physics::physics_named;
use crate::verdict::types::{Estimate, Finding, Parameter};

/// An effect in words; its name with spaces where the table has none.
pub fn physics(name: &str) -> String {
    physics_named(name).map_or_else(|| name.replace('_', " "), |p| p.words.to_string())
}

/// Where an effect acts, in words: `at the motor`, `between motor and drum`, `at the signal force`.
pub fn place(place: &Place) -> String {
    match place {
        Place::Between(a, b) if b == "ground" => format!("at the {a}"),
        Place::Between(a, b) if a == "ground" => format!("at the {b}"),
        Place::Between(a, b) => format!("between {a} and {b}"),
        Place::Signal(signal) => format!("at the signal {signal}"),
    }
}

/// An effect at its place in words: `dry friction at the drum`.
pub fn named(name: &str, at: &Place) -> String {
    format!("{} {}", physics(name), place(at))
}

/// A finding of a verdict in words: `backlash between motor and drum, 0.31 mm`.
pub fn finding(finding: &Finding) -> String {
    let size = physics_named(&finding.physics).and_then(|p| finding.parameters.get(p.size)).and_then(sized);
    format!("{}{}", named(&finding.physics, &finding.place), size.map_or(String::new(), |size| format!(", {size}")))
}

/// What explanations that cannot be separated have in common, and where they differ: `dry friction, at the motor or at the drum`.
pub fn any_of(all: &[(&str, &Place)]) -> String {
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
    let kin = all.first().and_then(|first| family(first.0)).filter(|first| all.iter().all(|one| family(one.0) == Some(first)));
    match kin {
        Some(kin) => format!("{kin}, {}", unique(all.iter().map(|one| place(one.1)).collect())),
        None => unique(all.iter().map(|one| named(one.0, one.1)).collect()),
    }
}

/// A parameter of a verdict with three digits and its unit; `None` for a list.
fn sized(parameter: &Parameter) -> Option<String> {
    let Estimate { value, unit, .. } = match parameter {
        Parameter::One(estimate) => estimate,
        Parameter::List(_) => return None,
    };
    let prefixed = matches!(unit.as_str(), "m" | "s" | "N" | "rad");
    let (scale, prefix) = match value.abs() {
        x if prefixed && x > 0.0 && x < 1e-3 && unit != "N" && x < 1e-4 => (1e6, "µ"),
        x if prefixed && x > 0.0 && x < 0.1 => (1e3, "m"),
        _ => (1.0, ""),
    };
    let number = backdrive_plant::write::round_significant(value * scale, 3);
    Some(format!("{number} {prefix}{unit}").trim_end().to_string())
}

/// A share or a confidence: `97 %`, `99.6 %`, `below 0.1 %`, `above 99.9 %`. No estimate is written as `0 %` or `100 %`.
pub fn share(value: f64) -> String {
    match value {
        v if !v.is_finite() => "unknown".to_string(),
        v if v < 1e-3 => "below 0.1 %".to_string(),
        v if v > 0.999 => "above 99.9 %".to_string(),
        v if v >= 0.995 => format!("{} %", backdrive_plant::write::round_significant(100.0 * v, 3)),
        v => format!("{} %", backdrive_plant::write::round_significant(100.0 * v, 2)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn a_finding_reads_in_words() {
        let between = |a: &str, b: &str| Place::Between(a.to_string(), b.to_string());
        let gap = Estimate { value: 0.00031, ci95: [Some(0.0003), Some(0.00032)], at_bound: false, unit: "m".to_string() };
        let found = Finding {
            physics: "backlash".to_string(),
            place: between("motor", "drum"),
            parameters: BTreeMap::from([("gap".to_string(), Parameter::One(gap))]),
            replaces: Vec::new(),
            confidence: 0.9,
            family: None,
            family_confidence: 0.0,
            alternatives: Vec::new(),
            closed_loop: None,
        };
        assert_eq!(finding(&found), "backlash between motor and drum, 0.31 mm");
        let (motor, drum, force) = (between("motor", "ground"), between("drum", "ground"), Place::Signal("force".to_string()));
        assert_eq!(any_of(&[("coulomb", &motor), ("dahl", &drum)]), "dry friction, at the motor or at the drum");
        assert_eq!(any_of(&[("coulomb", &motor), ("delay", &force)]), "dry friction at the motor or a delay at the signal force");
    }

    #[test]
    fn a_share_has_no_exponent() {
        let said = ["below 0.1 %", "0.23 %", "4 %", "97 %", "99 %", "99.6 %", "99.9 %", "above 99.9 %", "above 99.9 %"];
        assert_eq!([5.05e-123, 0.0023, 0.04, 0.97, 0.9949, 0.9962, 0.999, 0.9999, 1.0].map(share), said);
    }
}
