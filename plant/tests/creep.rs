//! A spring that goes on yielding, against the closed forms of a Kelvin-Voigt chain.

mod stepper_common;

use backdrive_plant::elements::{Creep, Law, PathLaw};
use backdrive_plant::linear::{LinearModel, Operating};
use backdrive_plant::model::OutputKind::{Position, Reaction};
use backdrive_plant::model::{Element, Place};
use backdrive_plant::stepper::{Options, Plant, Segment};
use std::f64::consts::TAU;
use stepper_common::*;

const K: f64 = 2000.0;
const CHAIN: [(f64, f64); 3] = [(5000.0, 0.05), (8000.0, 0.4), (3000.0, 2.0)];

fn law() -> Creep {
    Creep::new(K, CHAIN.map(|c| c.0).to_vec(), CHAIN.map(|c| c.1).to_vec()).unwrap()
}

fn creep(between: [Place; 2]) -> Element {
    Element { name: "creep".to_owned(), between, law: Law::Creep(law()) }
}

/// Displacement under a force from time 0 on, per force, m/N.
fn compliance(t: f64) -> f64 {
    1.0 / K + CHAIN.iter().map(|(k, tau)| (1.0 - (-t / tau).exp()) / k).sum::<f64>()
}

#[test]
fn moved_as_a_constant_force_moves_it_it_pushes_back_with_that_force() {
    let (law, force, h) = (law(), 7.0, 1e-4);
    let mut memory = vec![0.0; law.memory_len()];
    let mut x = force * compliance(0.0);
    // The step takes no time.
    law.advance(&mut memory, 0.0, x, 0.0);
    assert!((law.force(&memory, x, 0.0) - force).abs() < 1e-12);
    for i in 1..100_000 {
        let next = force * compliance(f64::from(i) * h);
        law.advance(&mut memory, x, next, h);
        x = next;
        assert!((law.force(&memory, x, 0.0) / force - 1.0).abs() < 1e-6, "{i}");
    }
}

#[test]
fn a_force_from_a_time_on_moves_a_body_as_it_creeps() {
    // Little mass and a damper that is soon overcome.
    let (force, period) = (3.0, 1e-3);
    let model = model(&[1e-5], vec![creep([at(0), GROUND]), damper([at(0), GROUND], 0.2)], vec![force_input(0)], vec![Position(0)]);
    let y = run(&model, &[samples(6000, period, |_| force)], period, None);
    // The damper delays by its force over the stiffness; 0.1 ms.
    for i in [100, 500, 2000, 5999] {
        let exact = force * compliance(i as f64 * period - 0.2 / K);
        assert!((y[0][i] / exact - 1.0).abs() < 1e-3, "{i}: {} {exact}", y[0][i]);
    }
}

#[test]
fn held_it_relaxes_by_its_two_times() {
    // One retarded spring: k_inf = k k1/(k + k1), and the rest dies away in tau k_inf/k.
    let (k1, tau, x0, period) = (1000.0, 0.3, 2e-3, 1e-4);
    let one = Element { name: "creep".to_owned(), between: [at(0), GROUND], law: Law::Creep(Creep::new(K, vec![k1], vec![tau]).unwrap()) };
    let model = model(&[0.0], vec![one], vec![motion_input(0)], vec![Reaction(0)]);
    let ramp = 10.0 * period;
    let y = run(&model, &[samples(8000, period, |t| x0 * (t / ramp).min(1.0))], period, Some(4));
    let relaxed = K * k1 / (K + k1);
    for i in [200, 1000, 3000, 7999] {
        let t = i as f64 * period - 0.5 * ramp;
        let exact = x0 * (relaxed + (K - relaxed) * (-t * K / relaxed / tau).exp());
        assert!((y[0][i] / exact - 1.0).abs() < 1e-4, "{i}: {} {exact}", y[0][i]);
    }
}

#[test]
fn steps_of_any_length_give_the_same_along_a_straight_path() {
    let law = law();
    let (mut once, mut often) = (vec![0.0; 3], vec![0.0; 3]);
    law.advance(&mut once, 0.0, 1e-3, 0.7);
    for i in 0..700 {
        law.advance(&mut often, 1e-3 / 700.0 * f64::from(i), 1e-3 / 700.0 * f64::from(i + 1), 1e-3);
    }
    assert!((law.force(&once, 1e-3, 0.0) / law.force(&often, 1e-3, 0.0) - 1.0).abs() < 1e-12);
}

#[test]
fn what_goes_in_is_stored_or_taken() {
    let model = model(&[0.2], vec![creep([at(0), GROUND])], vec![force_input(0)], vec![]);
    let mut plant = Plant::new(&model, 1e-3, &Options::default()).unwrap();
    plant.track_energy();
    let mut least = f64::INFINITY;
    for i in 0..4000 {
        let before = plant.energy().dissipated;
        plant.step(&[Segment::held(5.0 * (2e-2 * f64::from(i)).sin())]);
        least = least.min(plant.energy().dissipated - before);
    }
    let energy = plant.energy();
    assert!((energy.work_in - energy.kinetic - energy.stored - energy.dissipated).abs() < 1e-9 * energy.work_in.abs());
    assert!(energy.dissipated > 1e-4 && least > -1e-7 * energy.dissipated, "{energy:?} {least}");
}

#[test]
fn its_stiffness_at_a_frequency_is_that_of_the_chain() {
    let model = model(&[1.0], vec![creep([at(0), GROUND])], vec![force_input(0)], vec![Position(0)]);
    for hz in [0.01, 0.3, 2.0, 30.0] {
        let at = Operating { frequency_hz: hz, ..Operating::amplitude(1e-4) };
        let linear = LinearModel::new(&model, &at).unwrap();
        let w = TAU * hz;
        // J(iw) = 1/k + sum 1/(k_i (1 + iw tau_i)), inverted.
        let (mut re, mut im) = (1.0 / K, 0.0);
        for (k, tau) in CHAIN {
            let d = 1.0 + (w * tau).powi(2);
            re += 1.0 / (k * d);
            im -= w * tau / (k * d);
        }
        let size = re * re + im * im;
        assert!((linear.elements[0].stiffness * size / re - 1.0).abs() < 1e-10);
        assert!((linear.elements[0].damping * w * size / -im - 1.0).abs() < 1e-9);
        // A response has it at its own frequency, whatever the operating one: x/F = 1/(K*(iw) - m w²).
        let response = LinearModel::new(&model, &Operating::amplitude(1e-4)).unwrap().response(0, 0, &[hz]).unwrap()[0];
        let (stiff_re, stiff_im) = (re / size - w * w, -im / size);
        let exact = 1.0 / (stiff_re * stiff_re + stiff_im * stiff_im);
        assert!((response.re / (stiff_re * exact) - 1.0).abs() < 1e-9 && (response.im / (-stiff_im * exact) - 1.0).abs() < 1e-9);
    }
}

#[test]
fn lists_must_agree() {
    assert!(Creep::new(K, vec![1.0], vec![]).is_err() && Creep::new(K, vec![], vec![]).is_err());
}
