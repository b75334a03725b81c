//! The lists outside this folder that have to name every effect. A new effect fails each of these tests by its name until that list has it, or an
//! exception here states why not.

use super::tests::{devices, hypotheses};
use super::*;
use crate::hypothesis::Seen;
use backdrive_plant::elements::KINDS;
use backdrive_plant::stepper::Options;
use backdrive_plant::stepper::{Plant, Tangents};
use std::path::Path;

/// Effects that only a simulation can tell: most act on a signal, add a body, or keep a state that the motion of one body does not determine.
const SIMULATED_ONLY: [&str; 18] = [
    "gain",
    "inerter",
    "bandwidth",
    "saturation",
    "cubic_spring",
    "contact",
    "hunt_crossley",
    "load_friction",
    "gear_loss",
    "warm_friction",
    "series_compliance",
    "creep",
    "bouc_wen",
    "lugre",
    "hysteretic_spring",
    "maxwell_slip",
    "preisach_lugre",
    "backlash",
];

/// Effects that the hidden plant does not draw: faults of sensors and of numbers, which have draws of their own, and laws that only a second simulator draws.
const NOT_HIDDEN: [&str; 7] = ["offset", "gain", "contact", "hunt_crossley", "bouc_wen", "preisach_lugre", "gravity"];

/// Effects that the scorer of concealed cases has no family for, because no case hides them.
const NOT_SCORED: [&str; 4] = ["load_friction", "warm_friction", "creep", "gravity"];

/// Names of effects that are not in a list, and of those that a list of exceptions has for nothing.
fn differing(has: impl Fn(&str) -> bool, exceptions: &[&str]) -> [Vec<&'static str>; 2] {
    let of = |wrong: &dyn Fn(&str) -> bool| PHYSICS.iter().map(|p| p.name).filter(|name| wrong(name)).collect();
    [of(&|name| !has(name) && !exceptions.contains(&name)), of(&|name| has(name) && exceptions.contains(&name))]
}

/// A file of the workspace as text.
fn text_of(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

#[test]
fn every_effect_has_words_of_its_own() {
    for (i, physics) in PHYSICS.iter().enumerate() {
        assert!(!physics.words.is_empty() && !physics.size.is_empty(), "{}", physics.name);
        assert!(PHYSICS[..i].iter().all(|other| other.words != physics.words), "{} has another's words", physics.name);
    }
}

#[test]
fn every_effect_has_a_regressor_or_is_only_simulated() {
    let seen = Seen { travel: 1.0, speeds: (1..=100).map(|i| 0.01 * f64::from(i)).collect(), period: 1e-3 };
    let mut regressed: Vec<&str> = Vec::new();
    for (_, _, model) in devices() {
        regressed.extend(hypotheses(&model).0.iter().filter(|h| !(h.physics.facts.spans)(h, &seen).is_empty()).map(|h| h.physics.name));
    }
    assert_eq!(differing(|name| regressed.contains(&name), &SIMULATED_ONLY), [[""; 0]; 2]);
}

#[test]
fn every_law_has_derivatives_that_are_carried_along() {
    let (name, _, model) = devices().into_iter().find(|d| d.0.ends_with("impulse-engine.toml")).expect("there");
    let period = 1e-3;
    for h in hypotheses(&model).0.iter().filter(|h| KINDS.iter().any(|k| k.name == h.physics.name)) {
        let (start, mut moved) = (h.starts[0].clone(), h.starts[0].clone());
        let step = 1e-4 * start[0].abs().max(1e-6);
        moved[0] += step;
        let [base, other] = [&start, &moved].map(|values| h.apply(&model, values).expect("applies"));
        let plant = Plant::new(&base, period, &Options::default()).expect("a plant");
        assert!(Tangents::new(&plant, &base, &[(other, step)], period).is_some(), "{name}: {}", h.id);
    }
}

#[test]
fn every_effect_is_drawn_by_the_hidden_plant_or_left_to_others() {
    let (laws, others) = (text_of("sealed/src/laws/mod.rs"), text_of("sealed/src/effects/physics.rs"));
    let is_drawn = |name: &str| laws.contains(&format!("    {name}::")) || others.contains(&format!("=> \"{name}\""));
    assert_eq!(differing(is_drawn, &NOT_HIDDEN), [[""; 0]; 2]);
}

#[test]
fn every_effect_has_a_family_of_the_scorer() {
    let scorer = text_of("diagnosis/tests/concealed/effects.py");
    let families =
        scorer.split_once("FAMILY = ").and_then(|(before, after)| Some(format!("{before}{}", after.split_once("INPUT_KEYS")?.0)));
    let families = families.expect("the scorer's families are not where they were");
    assert_eq!(differing(|name| families.contains(&format!("\"{name}\"")), &NOT_SCORED), [[""; 0]; 2]);
}
