//! Devices and effects that several tests use.
#![allow(dead_code)]

use backdrive_sealed::effects::{Effect, Physics, Site};
use backdrive_sealed::laws::Law;
use backdrive_sealed::network::{Grip, Network};
use backdrive_sealed::plant::SealedPlant;
use backdrive_sealed::truth::Truth;
use std::path::PathBuf;

/// A device of a text.
pub fn device(text: &str) -> Network {
    Network::from_toml(text, "test.toml").unwrap()
}

/// A file of the workspace.
pub fn file(path: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A device of the workspace, in the normal grip where it takes one.
pub fn held(model: &str) -> Network {
    let network = Network::from_toml(&file(model), model).unwrap();
    let grip = Grip::from_toml(&file("plant/grips/normal.toml"), "normal.toml").unwrap();
    network.held(&grip)
}

/// A massless body that an input moves straight from sample to sample; its reaction is measured.
pub const RAM: &str = r#"
name = "ram"
[bodies]
ram = 0.0
[[inputs]]
name = "x"
kind = "motion"
on = "ram"
hold = "linear"
[[outputs]]
name = "force"
kind = "reaction"
of = "ram"
"#;

/// A mass under a force; its position and speed are measured.
pub const MASS: &str = r#"
name = "mass"
[bodies]
mass = 0.5
[[inputs]]
name = "f"
kind = "force"
on = "mass"
[[outputs]]
name = "x"
kind = "position"
of = "mass"
[[outputs]]
name = "v"
kind = "velocity"
of = "mass"
"#;

/// An element between a body and ground, as a model file writes it.
pub fn element(name: &str, body: &str, rest: &str) -> String {
    format!("[[elements]]\nname = \"{name}\"\nbetween = [\"{body}\", \"ground\"]\n{rest}\n")
}

/// A truth with effects and nothing else.
pub fn hiding(network: &Network, effects: Vec<(Physics, Site, Vec<&str>)>) -> Truth {
    let effect = |(physics, site, replaces): (Physics, Site, Vec<&str>)| {
        Effect::new(physics, site, replaces.into_iter().map(String::from).collect(), network)
    };
    Truth { effects: effects.into_iter().map(effect).collect(), ..Truth::nothing(network) }
}

/// A law that sits between a body and ground.
pub fn grounded(body: &str, law: Law) -> (Physics, Site, Vec<&'static str>) {
    (Physics::Law(law), Site::Between([body.to_string(), "ground".to_string()]), Vec::new())
}

/// Something at an input.
pub fn at_input(input: &str, physics: Physics) -> (Physics, Site, Vec<&'static str>) {
    (physics, Site::Signal(input.to_string()), Vec::new())
}

/// The exact outputs under an input as a function of time, at the end of each period.
pub fn run(plant: &mut SealedPlant, steps: usize, period_s: f64, input: impl Fn(f64) -> Vec<f64>) -> Vec<Vec<f64>> {
    (0..steps)
        .map(|k| {
            plant.step(&input(k as f64 * period_s)).unwrap();
            plant.exact_outputs().to_vec()
        })
        .collect()
}

/// Asserts that two numbers agree to a share of the second.
#[track_caller]
pub fn near(found: f64, expected: f64, share: f64) {
    assert!((found - expected).abs() <= share * expected.abs(), "found {found}, expected {expected} within {share} of it");
}
