//! Model files, grips and truth files.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod common;

use backdrive_sealed::draw::{DrawOptions, draw};
use backdrive_sealed::network::{Grip, Network};
use backdrive_sealed::plant::SealedPlant;
use backdrive_sealed::seal::{hash, seal};
use backdrive_sealed::truth::Truth;
use common::*;
use naming::assert_names;
use std::process::Command;

const MODELS: [&str; 8] = [
    "plant/models/impulse-engine.toml",
    "plant/models/impulse-engine-linear.toml",
    "plant/models/impulse-engine-second-order.toml",
    "plant/models/rigid-mass.toml",
    "plant/models/two-axis.toml",
    "plant/models/steering-compensator.toml",
    "plant/models/steering-compensator-sae-40.toml",
    "plant/models/ball-screw.toml",
];

#[test]
fn every_master_is_read_and_moves() {
    for model in MODELS.iter().chain(&["plant/models/engine-test-bench.toml"]) {
        let network = held(model);
        let mut plant = SealedPlant::new(&network, &Truth::nothing(&network), 2e-4).unwrap_or_else(|error| panic!("{model}: {error}"));
        let inputs = network.inputs.len();
        for k in 0..500 {
            plant.step(&vec![1e-3 * (0.01 * k as f64).sin(); inputs]).unwrap();
        }
        assert!(plant.exact_outputs().iter().all(|value| value.is_finite()), "{model}");
        assert!(plant.exact_outputs().iter().any(|value| *value != 0.0), "{model}");
    }
}

#[test]
fn a_grip_joins_user_and_hand() {
    let free = Network::from_toml(&file("plant/models/impulse-engine-linear.toml"), "m").unwrap();
    let network = held("plant/models/impulse-engine-linear.toml");
    assert_eq!(network.inputs.last().unwrap().name, "intent");
    assert_eq!(network.elements.len(), free.elements.len() + 2);
    let mut plant = SealedPlant::new(&network, &Truth::nothing(&network), 2e-4).unwrap();
    for k in 0..20_000 {
        plant.step(&[0.0, 1e-3 * (k as f64 / 5000.0).min(1.0)]).unwrap();
    }
    near(plant.position(network.body("motor").unwrap()), 1e-3, 1e-6);
    let second_order = Network::from_toml(&file("plant/models/impulse-engine-second-order.toml"), "m").unwrap();
    let grip = Grip::from_toml(&file("plant/grips/firm.toml"), "g").unwrap();
    assert_eq!(second_order.held(&grip), second_order, "its numbers hold the hand already");
    let two = Network::from_toml(&file("plant/models/two-axis.toml"), "m").unwrap();
    let both = two.held(&grip);
    assert_eq!(both.held(&grip), both, "one hand is enough");
    assert!(both.input("intent").is_some() && both.input("side_intent").is_some() && both.body("side_hand").is_some());
}

#[test]
fn errors_name_file_line_and_key() {
    let good = file("plant/models/impulse-engine-linear.toml");
    let wrong = [
        ("stiffness = 39500.0", "stifness = 39500.0", "elements[0] \"cable\": stiffness: missing"),
        ("stiffness = 39500.0", "stiffness = -1", "expected a finite number of at least 0, found -1"),
        ("stiffness = 39500.0", "stiffness = nan", "expected a finite number"),
        ("stiffness = 39500.0", "stiffness = \"a\"", "expected a finite number"),
        ("stiffness = 39500.0", "stiffness = 1.0\nstif = 2", "stif: unknown key"),
        ("kind = \"spring\"", "kind = \"sprng\"", "does not know \"sprng\""),
        ("kind = \"spring\"", "kind = \"bouc_wen\"", "does not know \"bouc_wen\""),
        ("[\"motor\", \"drum\"]", "[\"motor\", \"dram\"]", "there is no body \"dram\""),
        ("[\"motor\", \"drum\"]", "[\"motor\", \"motor\"]", "two different places"),
        ("[\"motor\", \"drum\"]", "[\"motor\"]", "expected two names"),
        ("name = \"cable_damping\"", "name = \"cable\"", "another one has this name"),
        ("motor  = 0.01075", "motor  = 0.0", "\"motor\" moves freely without inertia"),
        ("on   = \"motor\"", "on = \"moter\"", "there is no body \"moter\""),
        ("hold = \"zero\"", "hold = \"first\"", "expected \"zero\", \"linear\" or \"cubic\""),
        ("kind = \"position\"", "kind = \"reaction\"", "no motion input moves this body"),
        ("feedback = \"feedback_force\"", "feedback = \"force\"", "there is no input \"force\""),
        ("travel   = [-0.05, 0.05]", "travel = [1, 0]", "the lower one first"),
        ("motion = \"translation\"", "motion = \"sideways\"", "\"sideways\""),
        ("[bodies]", "[bodies", "not TOML"),
        ("[[inputs]]", "[inputs]", "write [[inputs]]"),
    ];
    for (from, to, expected) in wrong {
        assert!(good.contains(from), "{from}");
        let error = Network::from_toml(&good.replacen(from, to, 1), "m.toml").expect_err(to).to_string();
        assert!(error.starts_with("m.toml") && error.contains(expected), "{to}: {error}");
    }
    let line = Network::from_toml(&good.replacen("stiffness = 39500.0", "stiffness = -1", 1), "m.toml").unwrap_err().line.unwrap();
    assert_eq!(good.lines().nth(line - 1).unwrap().trim_start().split(' ').next(), Some("stiffness"));
    assert!(Network::from_toml(&file("plant/grips/firm.toml"), "g").unwrap_err().to_string().contains("a fragment, not a device"));
    assert_names(Grip::from_toml(&good, "m").unwrap_err().to_string(), &["kind = \"fragment\""]);
}

#[test]
fn no_torn_file_makes_it_panic() {
    for model in MODELS {
        let text = file(model);
        for end in (0..text.len()).step_by(37).filter(|end| text.is_char_boundary(*end)) {
            if let Ok(network) = Network::from_toml(&text[..end], "torn.toml") {
                let _ = SealedPlant::new(&network, &Truth::nothing(&network), 1e-3);
            }
        }
    }
}

#[test]
fn the_seal_is_what_sha256sum_prints() {
    let network = held("plant/models/impulse-engine-linear.toml");
    let truth = draw(&network, 11, &DrawOptions { effects: 2, ..DrawOptions::default() }).unwrap();
    let (bytes, sealed) = seal(&truth).unwrap();
    assert_eq!((bytes.clone(), sealed.clone()), seal(&truth.clone()).unwrap());
    let path = std::env::temp_dir().join(format!("backdrive-sealed-{}.json", std::process::id()));
    std::fs::write(&path, &bytes).unwrap();
    let printed = Command::new("sha256sum").arg(&path).output();
    std::fs::remove_file(&path).unwrap();
    let printed = String::from_utf8(printed.expect("sha256sum is on every Linux").stdout).unwrap();
    assert_eq!(printed.split_whitespace().next(), Some(sealed.as_str()));
    assert_eq!(hash(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    assert_eq!(Truth::from_json(&bytes).unwrap(), truth);
    let mut other = truth;
    other.hand.stiffness += 1e-15;
    assert_ne!(seal(&other).unwrap().1, sealed);
}

#[test]
fn bad_truths_are_refused_with_a_sentence() {
    let network = held("plant/models/impulse-engine-linear.toml");
    let truth = draw(&network, 3, &DrawOptions::default()).unwrap();
    let refused = |truth: &Truth| SealedPlant::new(&network, truth, 2e-4).map(|_| ()).unwrap_err().to_string();
    let mut other = truth.clone();
    other.nominal.sha256 = hash(b"other");
    assert!(refused(&other).contains("give the file that it was drawn for"));
    let free = Network::from_toml(&file("plant/models/impulse-engine-linear.toml"), "m").unwrap();
    assert!(SealedPlant::new(&free, &truth, 2e-4).map(|_| ()).unwrap_err().to_string().contains("this is none"), "the grip is missing");
    let mut wrong = truth.clone();
    wrong.numbers.insert("elements.nowhere.stiffness".into(), 1.1);
    assert_names(refused(&wrong), &["elements.nowhere.stiffness"]);
    let mut wrong = truth.clone();
    wrong.hand.damping = f64::NAN;
    assert_names(refused(&wrong), &["hand.damping"]);
    let mut wrong = truth.clone();
    wrong.sensors[0].output = "nothing".into();
    assert_names(refused(&wrong), &["sensors.nothing"]);
    assert!(Truth::from_json(b"{}").is_err() && Truth::from_json(b"\xff").is_err());
    let text = String::from_utf8(seal(&truth).unwrap().0).unwrap().replacen("\"schema\": 1", "\"schema\": 9", 1);
    assert_names(Truth::from_json(text.as_bytes()).unwrap_err().to_string(), &["schema 9"]);
}
