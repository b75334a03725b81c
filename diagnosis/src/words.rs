//! Physics and places in words, from one table: what headlines, texts and pages say in place of ids.

use crate::hypothesis::Place;
use crate::verdict::types::{Estimate, Finding, Parameter};

/// Name of a physics in a verdict, in words, and the parameter that says how large it is.
const NAMES: &[(&str, &str, &str)] = &[
    ("bias", "a constant force", "force"),
    ("offset", "a sensor offset", "offset"),
    ("gain", "a gain that is off", "gain"),
    ("inertia", "additional inertia", "inertia"),
    ("damper", "viscous friction", "damping"),
    ("back_emf", "back-EMF", "back_emf"),
    ("spring", "a spring", "stiffness"),
    ("inerter", "an inertance", "inertance"),
    ("coulomb", "dry friction", "force"),
    ("quadratic_drag", "quadratic drag", "coefficient"),
    ("delay", "a delay", "delay"),
    ("bandwidth", "a limited bandwidth", "bandwidth"),
    ("saturation", "saturation", "saturation"),
    ("asymmetric_damper", "viscous friction that differs by direction", "positive"),
    ("asymmetric_coulomb", "dry friction that differs by direction", "positive"),
    ("cubic_spring", "a stiffening spring", "cubic"),
    ("dahl", "dry friction with presliding (Dahl)", "coulomb"),
    ("stribeck", "dry friction with stiction (Stribeck)", "static"),
    ("friction_deficit", "dry friction that is lower near rest", "coulomb"),
    ("cogging", "a ripple over position (cogging)", "amplitude"),
    ("backlash", "backlash", "gap"),
    ("contact", "a contact", "stiffness"),
    ("hunt_crossley", "a contact (Hunt-Crossley)", "stiffness"),
    ("series_compliance", "a compliance in series", "stiffness"),
    ("bouc_wen", "hysteresis (Bouc-Wen)", "stiffness"),
    ("lugre", "dry friction with presliding (LuGre)", "coulomb"),
    ("hysteretic_spring", "a hysteretic spring", "stiffness_positive"),
    ("maxwell_slip", "presliding hysteresis (Maxwell slip)", "force"),
    ("preisach_lugre", "presliding hysteresis (Preisach)", "coulomb"),
];

/// A physics in words; its name with spaces where the table has none.
pub fn physics(name: &str) -> String {
    NAMES.iter().find(|n| n.0 == name).map_or_else(|| name.replace('_', " "), |n| n.1.to_string())
}

/// What a family of physics has in common, in words; `None` where that says nothing.
fn family(name: &str) -> Option<&'static str> {
    match crate::hypothesis::physics_named(name)?.family {
        "friction" => Some("dry friction"),
        "hysteresis" => Some("hysteresis"),
        "contact" => Some("a contact or backlash"),
        "stiffness" => Some("stiffness"),
        "damping" => Some("viscous friction"),
        "lag" => Some("a delay or lag"),
        _ => None,
    }
}

/// Where a physics acts, in words: `at the motor`, `between motor and drum`, `at the signal force`.
pub fn place(place: &Place) -> String {
    match place {
        Place::Between(a, b) if b == "ground" => format!("at the {a}"),
        Place::Between(a, b) if a == "ground" => format!("at the {b}"),
        Place::Between(a, b) => format!("between {a} and {b}"),
        Place::Signal(signal) => format!("at the signal {signal}"),
    }
}

/// A physics at its place in words: `dry friction at the drum`.
pub fn named(name: &str, at: &Place) -> String {
    format!("{} {}", physics(name), place(at))
}

/// A finding of a verdict in words: `backlash between motor and drum, 0.31 mm`.
pub fn finding(finding: &Finding) -> String {
    let size = NAMES.iter().find(|n| n.0 == finding.physics).and_then(|n| finding.parameters.get(n.2)).and_then(sized);
    format!("{}{}", named(&finding.physics, &finding.place), size.map_or(String::new(), |size| format!(", {size}")))
}

/// What explanations that cannot be told apart have in common, and where they differ: `dry friction, at the motor or at the drum`.
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
    use std::collections::BTreeMap;

    #[test]
    fn every_physics_has_a_name_in_words() {
        for physics in crate::hypothesis::PHYSICS {
            assert!(NAMES.iter().any(|n| n.0 == physics.name), "{}", physics.name);
        }
    }

    #[test]
    fn a_finding_reads_in_words() {
        let between = |a: &str, b: &str| Place::Between(a.to_string(), b.to_string());
        let gap = Estimate { value: 0.00031, ci95: [Some(0.0003), Some(0.00032)], unit: "m".to_string() };
        let found = Finding {
            physics: "backlash".to_string(),
            place: between("motor", "drum"),
            parameters: BTreeMap::from([("gap".to_string(), Parameter::One(gap))]),
            replaces: Vec::new(),
            confidence: 0.9,
            alternatives: Vec::new(),
        };
        assert_eq!(finding(&found), "backlash between motor and drum, 0.31 mm");
        let (motor, drum, force) = (between("motor", "ground"), between("drum", "ground"), Place::Signal("force".to_string()));
        assert_eq!(any_of(&[("coulomb", &motor), ("dahl", &drum)]), "dry friction, at the motor or at the drum");
        assert_eq!(any_of(&[("coulomb", &motor), ("delay", &force)]), "dry friction at the motor or a delay at the signal force");
    }

    #[test]
    fn a_share_has_no_exponent() {
        assert_eq!([5.05e-123, 0.04, 0.97, 0.9999].map(share), ["below 0.1 %", "4 %", "97 %", "above 99.9 %"]);
    }
}
