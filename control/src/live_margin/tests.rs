//! Loops whose critical gain is known.

use super::*;
use crate::margins::critical_factor;
use nalgebra::Complex;
use std::f64::consts::TAU;

const PERIOD: f64 = 1.0 / 5000.0;

/// A generator of numbers between -1 and 1 (xorshift).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A multisine from `from` to `to` on lines of 0.5 Hz, at most `peak`.
fn multisine(from: f64, to: f64, peak: f64) -> Vec<f64> {
    let mut noise = Noise(42);
    let lines: Vec<(f64, f64)> =
        (1..2000).map(|k| 0.5 * f64::from(k)).filter(|f| (from..=to).contains(f)).map(|f| (f, TAU * noise.next())).collect();
    let wave: Vec<f64> = (0..10_000).map(|i| lines.iter().map(|(f, phase)| (TAU * f * i as f64 * PERIOD + phase).cos()).sum()).collect();
    let most = wave.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    wave.into_iter().map(|x| peak * x / most).collect()
}

/// A mass on a spring against a wall, with one step of delay: `F_s = -wall x`, exactly discretised.
struct Loop {
    a: [f64; 4],
    b: [f64; 2],
    x: f64,
    v: f64,
}

const MASS: f64 = 0.03;
const DAMPING: f64 = 2.0;
const STIFFNESS: f64 = 4000.0;
const WALL: f64 = 3000.0;

impl Loop {
    fn new() -> Loop {
        let (w, sigma) = ((STIFFNESS / MASS - (DAMPING / (2.0 * MASS)).powi(2)).sqrt(), DAMPING / (2.0 * MASS));
        let (e, c, s) = ((-sigma * PERIOD).exp(), (w * PERIOD).cos(), (w * PERIOD).sin());
        let a = [e * (c + sigma / w * s), e * s / w, -e * STIFFNESS / (MASS * w) * s, e * (c - sigma / w * s)];
        Loop { a, b: [(1.0 - a[0]) / STIFFNESS, -a[2] / STIFFNESS], x: 0.0, v: 0.0 }
    }

    fn step(&mut self, force: f64) -> f64 {
        let [a, b, c, d] = self.a;
        (self.x, self.v) = (a * self.x + b * self.v + self.b[0] * force, c * self.x + d * self.v + self.b[1] * force);
        -WALL * self.x
    }

    /// `F_f(k) -> felt(k)`: the force moves the mass by the next step, and that is felt the other steps of the delay later.
    fn response(&self, hz: f64) -> Complex<f64> {
        let z = Complex::from_polar(1.0, TAU * hz * PERIOD);
        let [a, b, c, d] = self.a;
        let det = (z - a) * (z - d) - b * c;
        -WALL * ((z - d) * self.b[0] + self.b[1] * b) / det / z.powi(DELAY as i32 - 1)
    }

    /// The first stability limit of the loop, by a fine search.
    fn edge(&self) -> (f64, f64) {
        let hz: Vec<f64> = (1..8000).map(|i| 0.05 * f64::from(i)).collect();
        let l: Vec<_> = hz.iter().map(|f| self.response(*f)).collect();
        let found = critical_factor(&hz, &l).unwrap();
        (found.factor, found.frequency_hz)
    }
}

const DELAY: usize = 8;

/// Runs the loop at a gain; `hand` is what else is felt. Returns every estimate.
fn drive(dither: &[f64], lambda: f64, seconds: f64, mut hand: impl FnMut(f64) -> f64) -> Vec<(f64, Edge)> {
    let mut plant = Loop::new();
    let mut live = LiveMargin::new(dither, 0.01, PERIOD).unwrap();
    let mut line = [0.0; DELAY];
    let mut estimates = Vec::new();
    for k in 0..(seconds / PERIOD) as usize {
        let felt = line[k % DELAY] + hand(k as f64 * PERIOD);
        let sent = lambda * felt + dither[k % dither.len()];
        if live.step(dither[k % dither.len()], sent, Some(felt), 1.0) {
            estimates.push((k as f64 * PERIOD, live.edge()));
        }
        line[k % DELAY] = plant.step(sent);
    }
    estimates
}

#[test]
fn the_edge_of_a_known_loop_is_found_at_any_gain_below_it() {
    let (edge, hz) = Loop::new().edge();
    let dither = multisine(1.0, 500.0, 0.05);
    for share in [0.2, 0.5, 0.8] {
        let found = drive(&dither, share * edge, 4.0, |t| -2.0 - 0.3 * (TAU * 0.7 * t).sin());
        let (_, last) = found.last().unwrap();
        let Edge::At { lambda, frequency_hz, .. } = last else { panic!("{last:?}") };
        println!("at {share} of the edge: {:.3} of it, {frequency_hz:.1} of {hz:.1} Hz", lambda / edge);
        assert!((lambda / edge - 1.0).abs() < 0.1, "{lambda} of {edge}");
        assert!((frequency_hz / hz - 1.0).abs() < 0.04, "{frequency_hz} of {hz}");
        assert!(found[0].0 < 0.9 && found[0].1 == Edge::Settling, "one window is no answer: {:?}", found[0]);
    }
}

#[test]
fn noise_widens_the_answer_and_never_makes_a_wrong_one() {
    let (edge, _) = Loop::new().edge();
    let dither = multisine(1.0, 500.0, 0.05);
    let (mut told, mut beyond, mut at_least) = (0, 0, 0);
    for seed in 1..=12 {
        for size in [0.002, 0.01, 0.05] {
            let mut noise = Noise(seed * 7919 + (size * 1e4) as u64);
            for (_, found) in drive(&dither, 0.5 * edge, 3.0, |_| -1.0 + size * noise.next()) {
                match found {
                    Edge::At { lambda, deviation, .. } => {
                        (told, beyond) = (told + 1, beyond + usize::from((lambda / edge).ln().abs() > 0.05 + 3.0 * deviation));
                        assert!((lambda / edge).ln().abs() < 0.5, "{lambda} of {edge} with noise {size}: +-{deviation}");
                    }
                    Edge::Above { lambda } => {
                        at_least += 1;
                        assert!(lambda < 1.05 * edge, "above {lambda}, the edge is {edge}");
                    }
                    Edge::Free | Edge::Settling | Edge::Late => {}
                }
            }
        }
    }
    println!("{told} told, {beyond} beyond three deviations, {at_least} bounds");
    assert!(told > 50 && at_least > 20, "{told} {at_least}");
    assert!(beyond * 30 < told, "{beyond} of {told}");
}

#[test]
fn an_impact_and_another_level_of_the_dither_do_not_spoil_it() {
    let (edge, _) = Loop::new().edge();
    let quiet = multisine(1.0, 500.0, 0.02);
    let loud = multisine(1.0, 500.0, 0.08);
    let dither = [quiet, loud].concat();
    let impact = |t: f64| if t < 0.05 { -20.0 * (1.0 - t / 0.05) } else { -2.0 };
    let found = drive(&dither, 0.5 * edge, 4.0, impact);
    for (t, found) in &found {
        match found {
            Edge::At { lambda, deviation, .. } => {
                assert!((lambda / edge).ln().abs() < 0.1 + 3.0 * deviation, "{t}: {lambda} +-{deviation} of {edge}")
            }
            Edge::Above { lambda } => assert!(*lambda < edge, "{t}: above {lambda}, the edge is {edge}"),
            Edge::Free | Edge::Settling | Edge::Late => assert!(*t < 1.6, "{t}: {found:?}"),
        }
    }
    assert!(matches!(found.last(), Some((_, Edge::At { .. }))), "{found:?}");
}

#[test]
fn free_motion_and_the_hand_alone_tell_nothing() {
    let dither = multisine(1.0, 500.0, 0.05);
    let mut live = LiveMargin::new(&dither, 0.01, PERIOD).unwrap();
    let mut noise = Noise(3);
    for k in 0..10_000 {
        let d = dither[k % dither.len()];
        live.step(d, d, Some(0.0), 1.0);
        assert_eq!(live.edge(), Edge::Free);
    }
    for k in 0..10_000 {
        let d = dither[k % dither.len()];
        let felt = 1e-3 * noise.next();
        live.step(d, d + 0.5 * felt, Some(felt), 1.0);
        assert_eq!(live.edge(), Edge::Free, "sensor noise is no contact");
    }
    // A hand that shakes at a wall that does not yield to the dither: no stability limit may be reported.
    for k in 0..20_000 {
        let d = dither[k % dither.len()];
        let felt = -1.0 + 0.2 * (TAU * 9.0 * k as f64 * PERIOD).sin() + 0.05 * noise.next();
        live.step(d, d + 0.5 * felt, Some(felt), 1.0);
        assert!(!matches!(live.edge(), Edge::At { .. }), "{:?}", live.edge());
    }
}

#[test]
fn a_lost_contact_or_another_position_scale_begins_anew() {
    let (edge, _) = Loop::new().edge();
    let dither = multisine(1.0, 500.0, 0.05);
    let mut plant = Loop::new();
    let mut live = LiveMargin::new(&dither, 0.01, PERIOD).unwrap();
    let mut felt = 0.0;
    let mut run = |live: &mut LiveMargin, steps: usize, mu: f64| {
        for k in 0..steps {
            let d = dither[k % dither.len()];
            let sent = 0.3 * edge * felt + d;
            live.step(d, sent, Some(felt - 1.0), mu);
            felt = plant.step(sent);
        }
    };
    run(&mut live, 10_000, 1.0);
    assert_ne!(live.edge(), Edge::Free);
    run(&mut live, 1, 0.9);
    assert_eq!(live.edge(), Edge::Free);
    run(&mut live, 10_000, 0.9);
    assert_ne!(live.edge(), Edge::Free);
    for _ in 0..3 {
        live.step(0.0, 0.0, Some(0.0), 0.9);
    }
    assert_eq!(live.edge(), Edge::Free);
}

/// The loop at half of its critical gain, with some contact forces missing: then nothing is sent, and the master holds the last force.
fn with_gaps(seconds: f64, comes: impl Fn(usize) -> bool) -> (f64, Vec<Edge>) {
    let (edge, _) = Loop::new().edge();
    let dither = multisine(1.0, 500.0, 0.05);
    let (mut plant, mut live) = (Loop::new(), LiveMargin::new(&dither, 0.01, PERIOD).unwrap());
    let (mut line, mut sent, mut told) = ([0.0; DELAY], 0.0, Vec::new());
    for k in 0..(seconds / PERIOD) as usize {
        let d = dither[k % dither.len()];
        let now = comes(k).then_some(line[k % DELAY] - 1.0);
        if let Some(now) = now {
            sent = 0.5 * edge * now + d;
        }
        if live.step(d, if now.is_some() { sent } else { f64::NAN }, now, 1.0) {
            told.push(live.edge());
        }
        line[k % DELAY] = plant.step(sent);
    }
    (edge, told)
}

#[test]
fn single_contact_forces_that_do_not_come_cost_no_margin() {
    for every in [500, 50, 20] {
        let (edge, told) = with_gaps(4.0, |k| k % every != 0);
        let Some(Edge::At { lambda, deviation, .. }) = told.last() else { panic!("every {every}th: {:?}", told.last()) };
        assert!((lambda / edge).ln().abs() < 0.1 + 3.0 * deviation, "every {every}th: {lambda} of {edge} +-{deviation}");
    }
}

#[test]
fn a_gap_keeps_the_windows_before_it_and_many_gaps_are_told() {
    // A gap of 50 ms every 3 s: the answer stays.
    let (_, told) = with_gaps(8.0, |k| (k as f64 * PERIOD) % 3.0 > 0.05);
    let first = told.iter().position(|edge| matches!(edge, Edge::At { .. })).unwrap();
    assert!(told[first..].iter().all(|edge| matches!(edge, Edge::At { .. } | Edge::Above { .. })), "{told:?}");
    // One every 0.4 s: no window is completed, and that is reported.
    let (_, told) = with_gaps(8.0, |k| (k as f64 * PERIOD) % 0.4 > 0.05);
    assert_eq!(told, [Edge::Late]);
}

#[test]
fn over_cancelling_is_an_edge_at_dc() {
    // felt = +gain of a first-order lag of 25 Hz: positive feedback.
    let dither = multisine(1.0, 500.0, 0.05);
    let mut live = LiveMargin::new(&dither, 0.01, PERIOD).unwrap();
    let (mut lag, mut felt) = (0.0, 0.0);
    for k in 0..15_000 {
        let d = dither[k % dither.len()];
        let sent = 0.5 * felt + d;
        live.step(d, sent, Some(felt - 1.0), 1.0);
        lag += (1.0 - (-TAU * 25.0 * PERIOD).exp()) * (0.8 * sent - lag);
        felt = lag;
    }
    let Edge::At { lambda, frequency_hz, .. } = live.edge() else { panic!("{:?}", live.edge()) };
    assert_eq!(frequency_hz, 0.0);
    assert!((lambda * 0.8 - 1.0).abs() < 0.15, "{lambda}");
}

#[test]
fn lines_stay_within_the_dither_and_none_is_no_margin() {
    let live = LiveMargin::new(&multisine(30.0, 90.0, 0.05), 0.01, PERIOD).unwrap();
    assert!(live.lines_hz().iter().all(|f| (25.0..95.0).contains(f)), "{:?}", live.lines_hz());
    let wide = LiveMargin::new(&multisine(1.0, 500.0, 0.05), 0.01, PERIOD).unwrap();
    assert!((30..=MAX_LINES).contains(&wide.lines_hz().len()), "{}", wide.lines_hz().len());
    assert!(LiveMargin::new(&[], 0.01, PERIOD).is_none());
    assert!(LiveMargin::new(&[0.0; 100], 0.01, PERIOD).is_none());
    assert!(LiveMargin::new(&[f64::NAN; 100], 0.01, PERIOD).is_none());
}

#[test]
fn a_ring_down_tells_its_rate() {
    for rate in [12.0, -6.0] {
        let mut ring = RingDown::new(0.02, PERIOD);
        for k in 0..1500 {
            let t = k as f64 * PERIOD;
            ring.step(-1.0 + 2.0 * (-rate * t).exp() * (TAU * 40.0 * t).sin());
        }
        let found = ring.decay_per_s().unwrap();
        assert!((found / rate - 1.0).abs() < 0.05, "{found} of {rate}");
    }
    let mut quiet = RingDown::new(0.02, PERIOD);
    (0..5000).for_each(|k| quiet.step(-1.0 - 0.1 * (TAU * 0.5 * k as f64 * PERIOD).sin()));
    assert_eq!(quiet.decay_per_s(), None);
}
