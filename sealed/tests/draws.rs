//! Truths drawn from seeds.

mod common;

use backdrive_sealed::draw::{DrawOptions, draw};
use backdrive_sealed::plant::SealedPlant;
use backdrive_sealed::seal::seal;
use backdrive_sealed::truth::Truth;
use common::*;
use std::collections::BTreeSet;

#[test]
fn truths_of_every_device_are_drawn_and_move() {
    let masters = [
        "impulse-engine-linear",
        "impulse-engine",
        "impulse-engine-second-order",
        "rigid-mass",
        "two-axis",
        "steering-compensator",
        "ball-screw",
        "engine-test-bench",
    ];
    let networks: Vec<_> = masters.iter().map(|name| held(&format!("plant/models/{name}.toml"))).collect();
    let (mut kinds, mut masked, mut refused) = (BTreeSet::new(), 0, 0);
    for seed in 0..64 {
        let network = &networks[seed as usize % networks.len()];
        let options = DrawOptions { effects: (seed / 8 % 4) as usize, nonlinear_only: seed / 32 % 2 == 1, ..DrawOptions::default() };
        let truth = match draw(network, seed, &options) {
            Ok(truth) => truth,
            // One mass alone has few places.
            Err(error) => {
                assert!(network.bodies.len() < 3 && options.effects > 1, "{} seed {seed}: {error}", network.nominal.name);
                refused += 1;
                continue;
            }
        };
        assert_eq!(truth.effects.len(), options.effects);
        assert_eq!(Truth::from_json(&seal(&truth).unwrap().0).unwrap(), truth, "seed {seed}");
        for effect in &truth.effects {
            assert!(!(options.nonlinear_only && effect.physics.is_linear()), "seed {seed}");
            assert!(!effect.accept.is_empty() && effect.accept[0].site == effect.site);
            assert!(effect.accept[0].physics.iter().all(|name| effect.family.contains(name)), "seed {seed}: {effect:#?}");
            kinds.insert(effect.physics.name());
        }
        for (path, factor) in &truth.numbers {
            assert!((factor - 1.0).abs() <= 0.15 + 1e-3 && !path.contains("grip_"), "seed {seed}: {path} {factor}");
            masked += 1;
        }
        assert!((truth.hand.stiffness - 1.0).abs() <= 0.2 + 1e-3);
        let mut plant = SealedPlant::new(network, &truth, 2e-4).unwrap();
        let inputs = network.inputs.len();
        for k in 0..400 {
            let sample: Vec<f64> =
                (0..inputs).map(|i| if i == 0 { 3.0 * (0.05 * k as f64).sin() } else { 1e-3 * (0.01 * k as f64).sin() }).collect();
            plant.step(&sample).unwrap_or_else(|error| panic!("seed {seed}: {error}\n{truth:#?}"));
        }
        assert!(plant.outputs().iter().all(|value| value.is_finite()), "seed {seed}");
    }
    let all = [
        "coulomb",
        "asymmetric_coulomb",
        "stribeck",
        "friction_deficit",
        "dahl",
        "lugre",
        "maxwell_slip",
        "bristle_field",
        "warm_friction",
        "load_friction",
        "damper",
        "asymmetric_damper",
        "quadratic_drag",
        "cogging",
        "bias",
        "inertia",
        "cubic_spring",
        "hysteretic_spring",
        "backlash",
        "rounded_gap",
        "series_compliance",
        "delay",
        "bandwidth",
        "back_emf",
        "saturation",
    ];
    // The rest are found where joints carry the motion.
    let bench = &networks[networks.len() - 1];
    let mut seed = 64;
    while !all.iter().all(|kind| kinds.contains(kind)) && seed < 400 {
        let options = DrawOptions { masked_percent: 0.0, ..DrawOptions::default() };
        kinds.extend(draw(bench, seed, &options).unwrap().effects.iter().map(|effect| effect.physics.name()));
        seed += 1;
    }
    let missing: Vec<_> = all.iter().filter(|kind| !kinds.contains(*kind)).collect();
    assert!(missing.is_empty(), "never drawn: {missing:?}");
    assert!(refused < 8, "{refused}");
    assert!(masked > 60, "{masked}");
}

#[test]
fn the_same_seed_draws_the_same_truth_and_another_one_another() {
    let network = held("plant/models/impulse-engine-linear.toml");
    let options = DrawOptions { effects: 2, ..DrawOptions::default() };
    let sealed = |seed| seal(&draw(&network, seed, &options).unwrap()).unwrap().1;
    assert_eq!(sealed(5), sealed(5));
    let all: BTreeSet<_> = (0..8).map(sealed).collect();
    assert_eq!(all.len(), 8);
}

#[test]
fn options_out_of_range_are_refused() {
    let network = held("plant/models/rigid-mass.toml");
    let fine = DrawOptions::default();
    for (options, word) in [
        (DrawOptions { effects: 4, ..fine.clone() }, "effects is 4"),
        (DrawOptions { masked_percent: 60.0, ..fine.clone() }, "masked_percent is 60"),
        (DrawOptions { grip_percent: -1.0, ..fine.clone() }, "grip_percent is -1"),
        (DrawOptions { noise_share: f64::NAN, ..fine.clone() }, "noise_share"),
        (DrawOptions { working_force_n: f64::INFINITY, ..fine.clone() }, "working_force_n"),
        (DrawOptions { period_s: 0.0, ..fine.clone() }, "period_s is 0"),
    ] {
        assert!(draw(&network, 1, &options).unwrap_err().to_string().contains(word), "{word}");
    }
}

#[test]
fn without_masks_the_device_is_the_nominal_one_and_its_effects() {
    let network = held("plant/models/impulse-engine-linear.toml");
    let options =
        DrawOptions { effects: 0, masked_percent: 0.0, grip_percent: 0.0, encoder_share: 0.0, noise_share: 0.0, ..DrawOptions::default() };
    let truth = draw(&network, 9, &options).unwrap();
    assert!(truth.numbers.is_empty());
    let mut sealed = SealedPlant::new(&network, &truth, 2e-4).unwrap();
    let mut nominal = SealedPlant::new(&network, &Truth::nothing(&network), 2e-4).unwrap();
    for k in 0..500 {
        let inputs = [(0.03 * k as f64).sin(), 0.0];
        sealed.step(&inputs).unwrap();
        nominal.step(&inputs).unwrap();
        assert_eq!(sealed.outputs(), nominal.outputs());
    }
    let masked = draw(&network, 9, &DrawOptions { masked_percent: 20.0, ..options }).unwrap();
    assert!(!masked.numbers.is_empty() && masked.numbers.values().all(|factor| (factor - 1.0).abs() <= 0.2 + 1e-3));
}
