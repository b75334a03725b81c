use super::*;
use crate::coupling::four_channel::{FarSide, NearSide, Settings};
use nalgebra::Complex;
use std::f64::consts::TAU;

const MASTER: f64 = 0.1;
const STIFFNESS: f64 = 300.0;
const DAMPING: f64 = 4.0;

/// F_hand/v of a master of ideal mass through the law, with a slave that is exactly at its command on a spring and a damper; no delay but the one
/// step that a loop needs.
fn felt(settings: &Settings, hz: f64, period_s: f64) -> Complex<f64> {
    let (mut near, mut far) = (NearSide::new(settings), FarSide::new(settings));
    let (mut there, mut back) = (Way::constant(0), Way::constant(1));
    let cycle = (1.0 / (hz * period_s)).round();
    let omega = TAU / (cycle * period_s);
    let (steps, from) = (40 * cycle as u64, 30 * cycle as u64);
    let (mut x, mut v, mut tip, mut speed) = (0.0, 0.0, 0.0, 0.0);
    let (mut force_line, mut speed_line) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
    for step in 0..steps {
        let phase = Complex::new(0.0, omega * step as f64 * period_s).exp();
        let hand = phase.re;
        if step >= from {
            force_line += phase.conj() * hand;
            speed_line += phase.conj() * v;
        }
        let own = Own { position: x, velocity: v, moved: v * period_s, force: hand, power_scale: 1.0 };
        let (force, packet) = near.step(&own, back.take(step).as_ref(), period_s);
        there.send(step, packet);
        let own = Own { position: tip, velocity: speed, moved: 0.0, force: -STIFFNESS * tip - DAMPING * speed, power_scale: 1.0 };
        let (command, packet) = far.step(&own, there.take(step).as_ref(), period_s);
        back.send(step, packet);
        (speed, tip) = ((command - tip) / period_s, command);
        v += period_s / MASTER * (hand + force);
        x += period_s * v;
    }
    force_line / speed_line
}

fn environment(hz: f64) -> Complex<f64> {
    Complex::new(DAMPING, -STIFFNESS / (TAU * hz))
}

/// F_hand/v of Lawrence's architecture with C1 = Z_s + C, C2 = C3 = 1 and C4 = -(share Z_m + C).
fn closed_form(settings: &Settings, share: f64, hz: f64) -> Complex<f64> {
    let jw = Complex::new(0.0, TAU * hz);
    let control = Complex::new(settings.damping.unwrap(), 0.0) + Complex::new(settings.stiffness, 0.0) / jw;
    let slave = control + jw * settings.mass;
    let (outside, master) = (environment(hz), jw * MASTER);
    let follows = (outside - control - master * share) / (slave + outside);
    (master + control + follows * slave) / (Complex::new(1.0, 0.0) - follows)
}

#[test]
fn the_hand_feels_what_the_closed_form_says() {
    for (share, period_s) in [(0.0, 5e-5), (0.5, 5e-5), (0.9, 5e-5)] {
        let master_mass = if share > 0.0 { MASTER } else { 0.0 };
        let settings = Settings { stiffness: 1000.0, damping: Some(30.0), mass: 0.2, master_mass, compensation: share };
        for hz in [1.0, 3.0, 8.0] {
            let exact = closed_form(&settings, share, hz);
            let error = |period_s: f64| (felt(&settings, hz, period_s) - exact).norm() / exact.norm();
            let (coarse, fine) = (error(2.0 * period_s), error(period_s));
            assert!(fine < 0.02, "{share} taken away, {hz} Hz: {fine}");
            assert!(fine < 0.6 * coarse || fine < 5e-4, "half the step does not halve the error at {hz} Hz: {coarse} {fine}");
        }
    }
}

#[test]
fn with_exact_models_the_hand_feels_the_environment() {
    let settings = Settings { stiffness: 1000.0, damping: Some(30.0), ..Settings::DEFAULT };
    for hz in [1.0, 3.0, 8.0, 30.0] {
        let outside = environment(hz);
        let off = |share: f64| (closed_form(&settings, share, hz) - outside).norm() / outside.norm();
        assert!(off(1.0) < 1e-12, "{hz} Hz: {}", off(1.0));
        // The error is in proportion to the remaining inertia.
        assert!((off(0.9) / off(0.0) - 0.1).abs() < 0.02, "{hz} Hz: {} of {}", off(0.9), off(0.0));
    }
    // And so it is where it runs.
    let running = Settings { master_mass: MASTER, compensation: 0.9, ..settings };
    let left = (felt(&running, 8.0, 2e-5) - environment(8.0)).norm();
    let all = (felt(&settings, 8.0, 2e-5) - environment(8.0)).norm();
    assert!(left < 0.2 * all, "{left} N s/m are left of {all}");
}
