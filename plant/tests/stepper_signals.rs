//! What inputs and outputs do on the way: holds, gain, saturation, delay, bandwidth, back-EMF, offset, resolution.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod stepper_common;

use backdrive_plant::model::Hold;
use backdrive_plant::model::OutputKind::{Acceleration, Position, Reaction, Velocity};
use backdrive_plant::stepper::{CompileError, Options, Plant, Segment, simulate};
use naming::assert_names;
use std::f64::consts::TAU;
use stepper_common::*;

const PERIOD: f64 = 1e-3;

/// Acceleration and speed of 1 kg under an input; with a friction of no force it goes by substeps.
fn kilogram(input: backdrive_plant::model::Input, u: Vec<f64>, exact: bool) -> Vec<Vec<f64>> {
    let elements = if exact { vec![] } else { vec![coulomb([at(0), GROUND], 0.0)] };
    run(&model(&[1.0], elements, vec![input], vec![Acceleration(0), Velocity(0)]), &[u], PERIOD, if exact { None } else { Some(10) })
}

fn sine() -> Vec<f64> {
    samples(3000, PERIOD, |t| (TAU * 5.0 * t).sin())
}

/// Straight lines between samples, the first value before them.
fn between(u: &[f64], t: f64) -> f64 {
    let s = (t / PERIOD).max(0.0);
    let i = (s.floor() as usize).min(u.len() - 2);
    u[i] + (s - i as f64) * (u[i + 1] - u[i])
}

#[test]
fn input_delay() {
    let u = sine();
    for exact in [true, false] {
        for delay in [0.012, 0.0124, 0.0003] {
            let y = kilogram(backdrive_plant::model::Input { delay, ..force_input(0) }, u.clone(), exact);
            assert!(largest((1..3000).map(|i| y[0][i] - between(&u, i as f64 * PERIOD - delay))) < 1e-9);
            // The mean of the velocity's change is the mean of the delayed force.
            let mean = (y[1][1500] - y[1][1000]) / 0.5;
            let fine: f64 = (0..50_000).map(|i| between(&u, 1.0 - delay + (f64::from(i) + 0.5) * 1e-5)).sum::<f64>() / 50_000.0;
            assert!((mean - fine).abs() < 1e-6, "{exact} {delay}: {mean} {fine}");
        }
    }
}

#[test]
fn delayed_steps_arrive_on_time() {
    let mut input = backdrive_plant::model::Input { delay: 0.0123, hold: Hold::Zero, ..force_input(0) };
    input.gain = 2.0;
    for exact in [true, false] {
        // 1 N from the first sample on; before it a delayed input has its first value, here 0.
        let mut u = vec![1.0; 100];
        u[0] = 0.0;
        let y = kilogram(input.clone(), u, exact);
        assert!((y[1][50] - 2.0 * (0.050 - 0.0133)).abs() < 1e-12, "{}", y[1][50]);
    }
}

#[test]
fn input_bandwidth_is_a_first_order_lag() {
    let w = TAU * 5.0;
    for exact in [true, false] {
        let y = kilogram(backdrive_plant::model::Input { bandwidth: 10.0, ..force_input(0) }, sine(), exact);
        // H = 1/(1 + j/2): amplitude 1/sqrt(1.25), lag atan(1/2).
        let lagged = |t: f64| (w * t - 0.5f64.atan()).sin() / 1.25f64.sqrt();
        assert!(largest((600..3000).map(|i| y[0][i] - lagged(i as f64 * PERIOD))) < 3e-4);
    }
}

#[test]
fn saturation_comes_behind_gain() {
    for exact in [true, false] {
        let y = kilogram(backdrive_plant::model::Input { gain: 2.0, saturation: 0.6, ..force_input(0) }, sine(), exact);
        let u = sine();
        assert!(largest((1..3000).map(|i| y[0][i] - (2.0 * u[i]).clamp(-0.6, 0.6))) < 1e-12);
    }
}

#[test]
fn back_emf_limits_the_speed() {
    for exact in [true, false] {
        let y = kilogram(backdrive_plant::model::Input { back_emf: 4.0, ..force_input(0) }, vec![1.0; 3000], exact);
        assert!(largest((0..3000).map(|i| y[1][i] - 0.25 * (1.0 - (-4.0 * i as f64 * PERIOD).exp()))) < 1e-7);
    }
}

#[test]
fn holds_run_between_samples_as_they_say() {
    for exact in [true, false] {
        let u = sine();
        let y = kilogram(backdrive_plant::model::Input { hold: Hold::Zero, ..force_input(0) }, u.clone(), exact);
        assert!(largest((1..3000).map(|i| y[0][i] - u[i - 1])) < 1e-12);
        let y = kilogram(backdrive_plant::model::Input { hold: Hold::Cubic, ..force_input(0) }, u.clone(), exact);
        let exactly = |t: f64| (1.0 - (TAU * 5.0 * t).cos()) / (TAU * 5.0);
        assert!(largest((0..3000).map(|i| y[1][i] - exactly(i as f64 * PERIOD))) < 1e-8);
    }
}

#[test]
fn motion_inputs_have_gain_and_delay() {
    let input = backdrive_plant::model::Input { gain: -3.0, delay: 0.0025, ..motion_input(0) };
    let model = model(&[0.4], vec![], vec![input], vec![Position(0), Velocity(0), Acceleration(0), Reaction(0)]);
    let x = |t: f64| 0.01 * (1.0 - (9.0 * t).cos());
    let y = run(&model, &[samples(2000, PERIOD, x)], PERIOD, None);
    for i in 20..1990 {
        let t = i as f64 * PERIOD - 0.0025;
        assert!((y[0][i] + 3.0 * x(t)).abs() < 1e-9);
        assert!((y[1][i] + 0.27 * (9.0 * t).sin()).abs() < 1e-6);
        assert!((y[2][i] + 2.43 * (9.0 * t).cos()).abs() < 1e-3);
        assert!((y[3][i] - 0.4 * y[2][i]).abs() < 1e-12);
    }
}

#[test]
fn outputs_have_gain_delay_offset_and_resolution() {
    for exact in [true, false] {
        let elements = if exact { vec![] } else { vec![coulomb([at(0), GROUND], 0.0)] };
        let input = backdrive_plant::model::Input { hold: Hold::Cubic, ..force_input(0) };
        let mut model = model(&[1.0], elements, vec![input], vec![Position(0), Position(0), Position(0)]);
        (model.outputs[1].gain, model.outputs[1].delay, model.outputs[1].offset) = (-2.0, 0.0037, 0.1);
        (model.outputs[2].resolution, model.outputs[2].noise) = (1e-3, 1e-3);
        let y = run(&model, &[sine()], PERIOD, None);
        let way = |t: f64| t / (TAU * 5.0) - (TAU * 5.0 * t).sin() / (TAU * 5.0).powi(2);
        assert!(largest((10..3000).map(|i| y[1][i] - 0.1 + 2.0 * way(i as f64 * PERIOD - 0.0037))) / range(&y[1]) < 1e-5);
        assert_eq!(y[2], y[0], "noise and resolution are options");
        let with = |seed| {
            simulate(&model, &[sine()], PERIOD, &Options { add_noise: Some(seed), quantise: true, ..Options::default() }).expect("model")
        };
        let (a, b, other) = (with(1), with(1), with(2));
        assert_eq!(a[2], b[2]);
        assert_ne!(a[2], other[2]);
        assert!(a[2].iter().all(|q| (q / 1e-3 - (q / 1e-3).round()).abs() < 1e-6));
        let deviation = (a[2].iter().zip(&y[2]).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / 3000.0).sqrt();
        assert!((deviation / 1e-3 - (1.0f64 + 1.0 / 12.0).sqrt()).abs() < 0.1, "{deviation}");
    }
}

#[test]
fn a_clone_goes_on_from_the_same_state() {
    let elements = vec![coulomb([at(0), GROUND], 0.2), element("dahl", [at(0), GROUND], &[2000.0, 0.3]), spring([at(0), GROUND], 80.0)];
    let input = backdrive_plant::model::Input { delay: 0.0042, bandwidth: 40.0, ..force_input(0) };
    let mut plant = Plant::new(&model(&[0.3], elements, vec![input], vec![Position(0)]), PERIOD, &Options::default()).expect("model");
    let step = |plant: &mut Plant, i: i32| plant.step(&[Segment::held((0.03 * f64::from(i)).sin() * 2.0)]);
    (0..300).for_each(|i| step(&mut plant, i));
    let mut copy = plant.clone();
    (300..600).for_each(|i| step(&mut plant, i));
    (300..600).for_each(|i| step(&mut copy, i));
    assert_eq!(plant.position(0).to_bits(), copy.position(0).to_bits());
    let end = plant.position(0);
    plant.reset();
    (0..600).for_each(|i| step(&mut plant, i));
    assert_eq!(plant.position(0).to_bits(), end.to_bits());
}

#[test]
fn what_cannot_be_stepped_is_named() {
    let error = |model: &backdrive_plant::model::Model| Plant::new(model, PERIOD, &Options::default()).expect_err("an error").to_string();
    let massless = model(&[0.1, 0.0], vec![spring([at(0), at(1)], 10.0)], vec![force_input(0)], vec![]);
    assert_names(error(&massless), &["body1"]);
    let mut inerter = massless.clone();
    inerter.elements.push(element("inerter", [at(1), GROUND], &[0.2]));
    assert!(Plant::new(&inerter, PERIOD, &Options::default()).is_ok());
    let floating = model(&[0.0, 0.0], vec![element("inerter", [at(0), at(1)], &[0.2])], vec![force_input(0)], vec![]);
    assert!(matches!(Plant::new(&floating, PERIOD, &Options::default()), Err(CompileError::Massless(_))));
    let mut moved = massless.clone();
    moved.inputs.push(motion_input(1));
    assert!(Plant::new(&moved, PERIOD, &Options::default()).is_ok());
    moved.inputs.push(motion_input(1));
    assert!(matches!(Plant::new(&moved, PERIOD, &Options::default()), Err(CompileError::MovedTwice { .. })));
    let reaction = model(&[0.1], vec![], vec![], vec![Reaction(0)]);
    assert!(matches!(Plant::new(&reaction, PERIOD, &Options::default()), Err(CompileError::NoReaction { .. })));
    let dangling = model(&[0.1], vec![spring([at(0), at(3)], 1.0)], vec![], vec![]);
    assert!(matches!(Plant::new(&dangling, PERIOD, &Options::default()), Err(CompileError::Dangling(_))));
    let crowd = model(&[0.1; 65], vec![], vec![], vec![]);
    assert!(matches!(Plant::new(&crowd, PERIOD, &Options::default()), Err(CompileError::TooMany { .. })));
    assert!(matches!(
        Plant::new(&model(&[f64::NAN], vec![], vec![], vec![]), PERIOD, &Options::default()),
        Err(CompileError::Number { .. })
    ));
    for period in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(Plant::new(&reaction, period, &Options::default()), Err(CompileError::Period(_))));
    }
    let none = Options { substeps: Some(0), ..Options::default() };
    assert!(matches!(Plant::new(&inerter, PERIOD, &none), Err(CompileError::Substeps(0))));
    assert!(simulate(&inerter, &[] as &[Vec<f64>], PERIOD, &Options::default()).is_err());
}
