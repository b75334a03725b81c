use super::*;
use crate::coupling::wave::{NearSide, Settings};
use crate::coupling::wave_line::{Receiver, Sender};
use nalgebra::Complex;

const PERIOD: f64 = 1e-3;

#[test]
fn a_constant_delay_gives_out_what_went_in_and_no_energy_more() {
    let (mut sender, mut receiver, mut way) = (Sender::default(), Receiver::default(), Way::constant(37));
    let wave = |step: u64| (0.05 * step as f64).sin() + 0.3 * (0.31 * step as f64).cos();
    for step in 0..4000 {
        way.send(step, sender.send(wave(step), PERIOD));
        let out = receiver.receive(way.take(step).as_ref(), PERIOD);
        let due = step.checked_sub(37).map_or(0.0, wave);
        // Where the energy that is left is next to nothing its root rounds most.
        assert!((out - due).abs() < 1e-6, "step {step}: {out} for {due}");
        assert!(receiver.reserve() > -1e-12);
    }
}

#[test]
fn whatever_the_link_does_no_more_energy_comes_out_than_went_in_and_no_way_is_lost() {
    for (index, (delay, _, jitter, loss)) in LINKS.into_iter().enumerate() {
        let (mut sender, mut receiver) = (Sender::default(), Receiver::default());
        let mut way = Way::new(delay, jitter, loss, 40 + index as u64);
        let (mut sent, mut given, mut gone, mut come) = (0.0, 0.0, 0.0, 0.0);
        for step in 0..6000_u64 {
            // A push that ends: what is behind it must arrive.
            let wave = if step < 4000 { 1.0 + 0.8 * (0.02 * step as f64).sin() } else { 0.0 };
            way.send(step, sender.send(wave, PERIOD));
            let out = receiver.receive(way.take(step).as_ref(), PERIOD);
            sent += 0.5 * wave * wave * PERIOD;
            given += 0.5 * out * out * PERIOD;
            gone += wave * PERIOD;
            come += out * PERIOD;
            assert!(given <= sent + 1e-12, "link {index}, step {step}: {given} J out, {sent} J in");
        }
        assert!((gone - come).abs() < 1e-3 * gone, "link {index}: {come} of {gone} came");
    }
}

/// A line of round trip D that ends in a damper R is b (1 - r e^-jwD)/(1 + r e^-jwD), r = (b - R)/(b + R): the line's tanh formula.
#[test]
fn a_line_that_ends_in_a_damper_has_the_impedance_of_the_closed_form() {
    let settings = Settings::DEFAULT;
    let (b, round) = (settings.impedance, 90_u64);
    for (damper, hz) in [(5.0, 3.0), (20.0, 7.0), (80.0, 1.3), (80.0, 11.0)] {
        let reflected = (b - damper) / (b + damper);
        let mut near = NearSide::new(&settings);
        // The far end of the line, by its own definition: w = r u.
        let (mut there, mut back, mut receiver, mut sender) =
            (Way::constant(50), Way::constant(round - 50), Receiver::default(), Sender::default());
        let omega = std::f64::consts::TAU * hz;
        let cycle = (1.0 / (hz * PERIOD)).round();
        let omega = omega * (1.0 / (hz * PERIOD)) / cycle;
        let steps = 60 * cycle as u64;
        let (mut answer, from) = (Complex::new(0.0, 0.0), 50 * cycle as u64);
        for step in 0..steps {
            let phase = Complex::new(0.0, omega * step as f64 * PERIOD).exp();
            let own = Own { velocity: phase.re, ..Own::default() };
            let (force, packet) = near.step(&own, back.take(step).as_ref(), PERIOD);
            there.send(step, packet);
            let wave = receiver.receive(there.take(step).as_ref(), PERIOD);
            back.send(step, sender.send(reflected * wave, PERIOD));
            if step >= from {
                answer += phase.conj() * -force * 2.0 / (steps - from) as f64;
            }
        }
        let turn = Complex::new(0.0, -omega * round as f64 * PERIOD).exp() * reflected;
        let exact = (Complex::new(1.0, 0.0) - turn) / (Complex::new(1.0, 0.0) + turn) * b;
        assert!((answer - exact).norm() < 1e-4 * exact.norm(), "R = {damper} at {hz} Hz: {answer} for {exact}");
    }
}
