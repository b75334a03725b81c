use super::*;
use crate::coupling::Conditions;
use crate::coupling::virtual_coupling::{FarSide, Settings};
use nalgebra::Complex;

const PERIOD: f64 = 1e-3;
const CONDITIONS: Conditions = Conditions { period_s: PERIOD, round_trip_s: 0.0, held_steps: 0 };

/// N/m
const STIFFNESS: f64 = 4000.0;

/// The force of the coupling on the master when its point is held and the master is moved by a unit for one step: the response that
/// Colgate & Schenkel's condition is about.
fn response(settings: &Settings) -> Vec<f64> {
    let mut far = FarSide::new(settings, &CONDITIONS);
    // Begins at 0, so that the point is there.
    far.step(&Own::default(), Some(&Packet::default()), PERIOD);
    let mut before = 0.0;
    let mut force = Vec::new();
    for step in 0..4 {
        let position = if step == 0 { 1.0 } else { 0.0 };
        let packet = Packet { position, velocity: (position - before) / PERIOD, effort: 0.0 };
        before = position;
        // The force that holds the point: the answer is linear in it.
        let answer = |outside: f64| {
            let own = Own { force: outside, ..Own::default() };
            far.clone().step(&own, Some(&packet), PERIOD).0
        };
        let (at_rest, pushed) = (answer(0.0), answer(1.0));
        let outside = -at_rest / (pushed - at_rest);
        let own = Own { force: outside, ..Own::default() };
        let (point, sent) = far.step(&own, Some(&packet), PERIOD);
        assert!(point.abs() < 1e-9, "the point is held: {point}");
        force.push(-sent.effort);
    }
    force
}

/// b > T/2 max_w Re{(1 - e^-jwT) H(e^jwT)} / (1 - cos wT) is K T/2 + |B| for a coupling K + B (1 - z^-1)/T.
#[test]
fn the_bound_is_that_of_colgate_and_schenkel() {
    for (stiffness, damping) in [(2000.0, 30.0), (5000.0, 1.0), (500.0, 80.0)] {
        let settings = Settings { stiffness: Some(stiffness), damping, injection: None };
        let h = response(&settings);
        let needed = |turn: f64| {
            let back = Complex::new(0.0, -turn).exp();
            let (sum, _) = h.iter().fold((Complex::new(0.0, 0.0), Complex::new(1.0, 0.0)), |(sum, z), f| (sum + z * *f, z * back));
            0.5 * PERIOD * ((Complex::new(1.0, 0.0) - back) * sum).re / (1.0 - turn.cos())
        };
        let most = (1..2000).map(|i| needed(std::f64::consts::PI * f64::from(i) / 2000.0)).fold(f64::NEG_INFINITY, f64::max);
        let most = most.max(needed(std::f64::consts::PI));
        let stated = settings.least_device_damping(&CONDITIONS);
        // B acts with the sign of cos wT: at the slowest motion it helps, at half the rate it costs.
        assert!((most - stated).abs() < 1e-6 * stated, "K {stiffness}, B {damping}: needs {most}, stated {stated}");
    }
}

/// A mass with damping b, a spring of stiffness K held over each step: energy is created where b is below the bound, and not above.
#[test]
fn a_device_above_the_bound_rests_and_one_below_does_not() {
    let settings = Settings { stiffness: Some(STIFFNESS), damping: 0.01, injection: Some(0.0) };
    let bound = settings.least_device_damping(&CONDITIONS);
    let swing = |device: f64| {
        let (mass, mut x, mut v, mut before) = (0.1, 1e-3, 0.0, 1e-3);
        for _ in 0..4000 {
            let force = -STIFFNESS * x - settings.damping * (x - before) / PERIOD;
            before = x;
            // Exact for a held force.
            let (rate, drift) = (device / mass, force / device);
            let decay = (-rate * PERIOD).exp();
            x += drift * PERIOD + (v - drift) * (1.0 - decay) / rate;
            v = drift + (v - drift) * decay;
        }
        f64::hypot(x, v * 5e-3)
    };
    assert!(swing(1.2 * bound) < 1e-6, "{}", swing(1.2 * bound));
    assert!(swing(0.5 * bound) > 1e-3, "{}", swing(0.5 * bound));
}

/// By default what is injected is K times the time of the answer, and never more than a hand-held master bears.
#[test]
fn a_long_way_makes_the_coupling_soft_and_not_the_damping_large() {
    for (round_trip_s, stiffness, injection) in [(0.0, 2000.0, 1.0), (0.0195, 2000.0, 40.0), (0.3995, 200.0, 80.0)] {
        let conditions = Conditions { round_trip_s, ..CONDITIONS };
        let (found, damping) = (Settings::DEFAULT.stiffness_for(&conditions), Settings::DEFAULT.injection_for(&conditions));
        assert!((found - stiffness).abs() < 1e-9 && (damping - injection).abs() < 1e-9, "{round_trip_s}: {found} {damping}");
    }
}
