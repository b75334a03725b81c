//! The steering compensator (Papageorgiou et al. 2007): its network against equation (2), its invariant point and resonances, and what friction,
//! gap and hysteretic friction do to its admittance.

use backdrive_plant::correlation::{Resolution, admittance_of};
use backdrive_plant::elements::{Backlash, Coulomb, Law};
use backdrive_plant::linear::{LinearModel, Operating};
use backdrive_plant::model::{Fragment, Model};
use nalgebra::Complex;
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

const FINE: Resolution = Resolution { steps_per_cycle: 2000, rate_hz: 4000.0, settle_s: 0.7, cycles: 1 };

fn file(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn environment(suffix: &str) -> Fragment {
    Fragment::load(&file(&format!("environments/steering-compensator{suffix}.toml"))).unwrap()
}

fn design(c: f64) -> Model {
    let mut model = environment("").driven();
    model.set_values_at("elements.oil.damping", &[c]).unwrap();
    model
}

fn linear(model: &Model, f: f64) -> Complex<f64> {
    let linear = LinearModel::new(model, &Operating::small()).unwrap();
    linear.response(0, 0, &[f]).unwrap()[0] / Complex::new(0.0, TAU * f)
}

fn law<'a>(model: &'a mut Model, name: &str) -> &'a mut Law {
    &mut model.elements.iter_mut().find(|e| e.name == name).unwrap().law
}

fn degrees(y: Complex<f64>) -> f64 {
    y.arg().to_degrees()
}

#[test]
fn the_environment_and_the_model_are_one_device() {
    for suffix in ["", "-sae-10", "-sae-20", "-sae-30", "-sae-40"] {
        let model = Model::load(&file(&format!("models/steering-compensator{suffix}.toml"))).unwrap();
        let driven = environment(suffix).driven();
        let laws = |m: &Model| m.elements.iter().map(|e| (e.name.clone(), e.between, e.law.clone())).collect::<Vec<_>>();
        assert_eq!(laws(&model), laws(&driven), "{suffix}");
        assert_eq!(model.bodies.len(), driven.bodies.len());
    }
    // As a master it is the same device behind a lever of some inertia.
    let master = Model::load(&file("models/steering-compensator-master.toml")).unwrap();
    let driven = environment("-sae-10").driven();
    assert!(master.elements.iter().zip(&driven.elements).all(|(a, b)| a.law == b.law && a.between == b.between));
}

/// Equation (2) and its limits c = 0 and c -> infinity.
#[test]
fn the_network_is_equation_2_and_has_its_limits() {
    let (k, b, b1) = (480e3, 98.4, 21.6);
    for f in [0.1, 3.24, 9.0, 18.0, 35.0] {
        let s = Complex::new(0.0, TAU * f);
        for c in [690.0, 1380.0, 2759.0, 5518.0] {
            let expected = k * s * (b * b1 * s + c * (b + b1)) / (b * b1 * s * s * s + c * (b + b1) * s * s + k * b * s + k * c);
            assert!((linear(&design(c), f) / expected - 1.0).norm() < 1e-9);
        }
        let (free, stiff) = (k * s / (s * s + k / b1), k * s / (s * s + k / (b + b1)));
        assert!((linear(&design(1e-6), f) / free - 1.0).norm() < 1e-6);
        assert!((linear(&design(1e12), f) / stiff - 1.0).norm() < 1e-6);
    }
}

#[test]
fn the_invariant_point_does_not_know_the_oil() {
    let omega = (0.5 * (480e3 / 21.6 + 480e3 / 120.0f64)).sqrt();
    assert!((omega / TAU - 18.2238).abs() < 1e-4);
    for exponent in -3..=6 {
        let gain = linear(&design(10f64.powi(exponent)), omega / TAU).norm();
        assert!((gain / 6032.3932 - 1.0).abs() < 1e-6, "c = 1e{exponent}: {gain}");
    }
}

#[test]
fn the_peaks_are_those_of_the_discs() {
    for (c, wanted) in [(1.0, 23.725), (1e7, 10.066)] {
        let model = design(c);
        let peak = (0..=4000)
            .map(|i| wanted * (0.98 + 1e-5 * f64::from(i)))
            .max_by(|a, b| linear(&model, *a).norm().total_cmp(&linear(&model, *b).norm()));
        assert!((peak.unwrap() / wanted - 1.0).abs() < 1e-3, "{peak:?}");
    }
}

#[test]
fn the_gap_is_two_alpha_times_the_lever() {
    for suffix in ["-sae-10", "-sae-20", "-sae-30", "-sae-40", "-hysteretic"] {
        let gap = environment(suffix).driven().values_at("elements.gearbox.gap").unwrap()[0];
        assert!((gap - 2.0 * 0.00336 * 0.050).abs() < 1e-12 && (gap - 0.336e-3).abs() < 1e-12);
    }
}

#[test]
fn correlation_finds_what_the_linear_model_says() {
    for f in [0.1, 3.24, 20.21, 35.0] {
        let model = design(1380.0);
        let found = admittance_of(&model, [0, 0], f, 1e-3, &Resolution { settle_s: 3.0, ..FINE }).unwrap();
        assert!((found / linear(&model, f) - 1.0).norm() < 1e-4, "{f}: {found}");
    }
}

/// 4F/(pi V): the gain of dry friction falls with the speed, the phase stays just below 0.
#[test]
fn friction_makes_the_gain_fall_at_low_frequencies() {
    let mut model = environment("-sae-10").driven();
    *law(&mut model, "gearbox") = Law::Backlash(Backlash { gap: 0.0, stiffness: 563e3, damping: 100.0, rounding: 0.0 });
    *law(&mut model, "friction") = Law::Coulomb(Coulomb { force: 16.38 });
    let stroke = 10e-3;
    let at = |f: f64| admittance_of(&model, [0, 0], f, stroke, &FINE).unwrap();
    let (slow, slower) = (at(0.02), at(0.002));
    assert!((slower.norm() / slow.norm() / 10.0 - 1.0).abs() < 0.03, "{slow} {slower}");
    for (f, y) in [(0.02, slow), (0.002, slower)] {
        let expected = 4.0 * 16.38 / (PI * TAU * f * stroke) + 370.0;
        assert!((y.norm() / expected - 1.0).abs() < 0.01, "{f}: {y} {expected}");
        assert!((-6.0..0.0).contains(&degrees(y)), "{f}: {}", degrees(y));
    }
}

/// Behind the gap the gain falls faster than 20 dB per decade while the phase stays above -90 degrees, the more the smaller the stroke.
#[test]
fn backlash_makes_the_gain_fall_faster_than_its_phase_says() {
    let with = environment("-sae-10").driven();
    let mut without = with.clone();
    *law(&mut without, "gearbox") = Law::Backlash(Backlash { gap: 0.0, stiffness: 861e3, damping: 100.0, rounding: 0.0 });
    let of = |model: &Model, f: f64, stroke: f64| admittance_of(model, [0, 0], f, stroke, &FINE).unwrap();
    let slope = |model: &Model, stroke: f64| {
        let [low, high] = [24.27, 35.0].map(|f| of(model, f, stroke).norm());
        20.0 * (high / low).log10() / (35.0f64 / 24.27).log10()
    };
    let mut slopes = Vec::new();
    for stroke in [2e-3, 1e-3, 0.5e-3, 0.3e-3] {
        let (steep, plain) = (slope(&with, stroke), slope(&without, stroke));
        let phase = degrees(of(&with, 35.0, stroke));
        println!("{:.1} mm: {steep:.1} dB per decade with the gap, {plain:.1} without; phase at 35 Hz {phase:.1}", 1e3 * stroke);
        assert!(phase > -90.0 && steep < plain, "{phase} {steep} {plain}");
        slopes.push((steep, phase));
    }
    assert!(slopes[2].0 < -20.0 && slopes[2].1 > -80.0, "{slopes:?}");
}

/// Friction that comes back over a distance behind each reversal lags the velocity.
#[test]
fn hysteretic_friction_adds_lag_at_low_frequencies() {
    let of = |suffix: &str, f: f64| degrees(admittance_of(&environment(suffix).driven(), [0, 0], f, 10e-3, &FINE).unwrap());
    let (sudden, refined) = (of("-sae-10", 0.1), of("-hysteretic", 0.1));
    println!("phase at 0.1 Hz: {sudden:.2} with friction at once, {refined:.2} with presliding");
    assert!(refined < sudden - 1.0 && refined > -20.0 && sudden < 0.0, "{sudden} {refined}");
}

/// Nordin's shaft becomes the dead zone as its damping goes to 0, in the whole device too.
#[test]
fn the_shaft_becomes_a_dead_zone() {
    let of = |damping: f64| {
        let mut model = environment("-sae-10").driven();
        model.set_values_at("elements.gearbox.damping", &[damping]).unwrap();
        admittance_of(&model, [0, 0], 20.21, 0.5e-3, &FINE).unwrap()
    };
    let dead_zone = of(0.0);
    let off: Vec<f64> = [1000.0, 100.0, 10.0, 1.0].iter().map(|c| (of(*c) / dead_zone - 1.0).norm()).collect();
    println!("{off:?}");
    assert!(off[0] > off[1] && off[3] < 2e-3, "{off:?}");
}

/// The steps of a fit are fine enough, and the error falls with them.
#[test]
fn coarser_steps_move_the_admittance_little() {
    let model = environment("-sae-10").driven();
    let mut worst = [0.0_f64; 2];
    for (f, stroke) in [(0.1, 10e-3), (0.5, 10e-3), (1.2, 8e-3), (3.24, 3e-3), (8.09, 1.2e-3), (20.21, 0.8e-3), (35.0, 0.6e-3)] {
        let of = |steps_per_cycle: usize, rate_hz: f64| {
            admittance_of(&model, [0, 0], f, stroke, &Resolution { steps_per_cycle, rate_hz, ..FINE }).unwrap()
        };
        let fine = of(4000, 16_000.0);
        for (worst, (steps, rate)) in worst.iter_mut().zip([(400, 500.0), (1600, 2000.0)]) {
            let off = (of(steps, rate) / fine - 1.0).norm();
            println!("{f} Hz, {steps} steps: {off:.5}");
            *worst = worst.max(off);
        }
    }
    assert!(worst[0] < 0.01 && worst[1] < 0.5 * worst[0], "{worst:?}");
}
