//! Convergence, determinism, sensors.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod common;

use backdrive_sealed::effects::{Physics, Site};
use backdrive_sealed::laws::*;
use backdrive_sealed::plant::SealedPlant;
use backdrive_sealed::truth::{Sensor, Truth};
use common::*;
use naming::assert_names;

fn everything() -> (backdrive_sealed::network::Network, Truth) {
    let network = held("plant/models/impulse-engine-linear.toml");
    let bristles = BristleField {
        stiffness: 3000.0,
        force: 0.1,
        stiffness_spread: 0.5,
        force_spread: 0.5,
        count: 40,
        static_ratio: 1.4,
        velocity: 0.01,
    };
    let gap = RoundedGap { gap: 2e-4, rounding: 2e-5, stiffness: 4200.0, damping: 1.0 };
    let truth = hiding(
        &network,
        vec![
            grounded("motor", Law::BristleField(bristles)),
            grounded("drum", Law::Stribeck(Stribeck { coulomb: 0.1, at_rest: 0.15, velocity: 0.01 })),
            (Physics::Law(Law::RoundedGap(gap)), Site::Between(["drum".into(), "handle".into()]), vec!["linkage", "linkage_damping"]),
        ],
    );
    (network, truth)
}

fn record(plant: &mut SealedPlant) -> Vec<Vec<f64>> {
    (0..3000)
        .map(|k| {
            let t = k as f64 * 2e-4;
            plant.step(&[3.0 * (40.0 * t + 200.0 * t * t).sin(), 2e-3 * (6.0 * t).sin()]).unwrap();
            plant.outputs().to_vec()
        })
        .collect()
}

#[test]
fn halving_the_substep_changes_less_and_less() {
    let (mut network, truth) = everything();
    network.outputs[0].resolution = 0.0;
    let base = SealedPlant::new(&network, &truth, 2e-4).unwrap().substeps();
    let with = |times: usize| record(&mut SealedPlant::with_substeps(&network, &truth, 2e-4, base * times).unwrap());
    let finest = with(16);
    let range = finest.iter().fold(0.0_f64, |most, row| most.max(row[0].abs()));
    let off = |rows: &[Vec<f64>]| rows.iter().zip(&finest).fold(0.0_f64, |most, (a, b)| most.max((a[0] - b[0]).abs())) / range;
    let (one, two, four) = (off(&with(1)), off(&with(2)), off(&with(4)));
    assert!(one < 2e-4, "{one} {two} {four}");
    // First order where surfaces begin to stick, which is at another substep each time: less from one to four, not always from two to four.
    assert!(two < 0.6 * one && four < 0.4 * one, "{one} {two} {four}");
    assert!(one > 0.0);
    // A third of the work where a look is enough.
    let mut coarse = SealedPlant::coarse(&network, &truth, 2e-4).unwrap();
    assert!(coarse.substeps() * 2 < base, "{} {base}", coarse.substeps());
    let off = off(&record(&mut coarse));
    assert!(off < 2e-3, "{off}");
}

#[test]
fn the_same_truth_gives_the_same_bits_and_another_seed_other_noise() {
    let (network, mut truth) = everything();
    truth.sensors = vec![Sensor { output: "motor_position".into(), resolution: 1e-6, noise: 2e-6 }];
    truth.noise_seed = 7;
    let bits = |truth: &Truth| -> Vec<u64> {
        record(&mut SealedPlant::new(&network, truth, 2e-4).unwrap()).iter().map(|row| row[0].to_bits()).collect()
    };
    let first = bits(&truth);
    assert_eq!(first, bits(&truth));
    assert_ne!(first, bits(&Truth { noise_seed: 8, ..truth.clone() }));
}

#[test]
fn noise_has_its_size_and_an_encoder_its_steps() {
    let network = device(MASS);
    let mut truth = Truth::nothing(&network);
    truth.sensors =
        vec![Sensor { output: "x".into(), resolution: 0.25, noise: 2.0 }, Sensor { output: "v".into(), resolution: 0.0, noise: 0.5 }];
    let mut plant = SealedPlant::new(&network, &truth, 1e-3).unwrap();
    let mut rows = Vec::new();
    for _ in 0..20_000 {
        plant.step(&[0.0]).unwrap();
        rows.push(plant.outputs().to_vec());
    }
    let deviation = |output: usize| (rows.iter().map(|row| row[output] * row[output]).sum::<f64>() / rows.len() as f64).sqrt();
    near(deviation(0), (4.0 + 0.25 * 0.25 / 12.0_f64).sqrt(), 0.03);
    near(deviation(1), 0.5, 0.03);
    assert!(rows.iter().all(|row| (row[0] / 0.25).fract() == 0.0));
    let together = rows.iter().map(|row| row[0] * row[1]).sum::<f64>() / rows.len() as f64;
    assert!(together.abs() < 0.03, "the two outputs' noises are strangers: {together}");
}

#[test]
fn wrong_inputs_are_refused_and_change_nothing() {
    let (network, truth) = everything();
    let mut plant = SealedPlant::new(&network, &truth, 2e-4).unwrap();
    assert_names(plant.step(&[1.0]).unwrap_err().to_string(), &["1 inputs", "has 2"]);
    assert_names(plant.step(&[1.0, f64::NAN]).unwrap_err().to_string(), &["input 1"]);
    let mut untouched = SealedPlant::new(&network, &truth, 2e-4).unwrap();
    assert_eq!(record(&mut plant), record(&mut untouched));
}
