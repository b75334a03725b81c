//! Limit cycles with known answers: a relay, Coulomb friction with delay, backlash in the loop.
//!
//! Each loop is built of model files and run by the product, and its verdict compared with a solution of the same loop by code that shares nothing
//! with it. Between samples each of these loops is linear (or slides under a constant force), so it is carried from sample to sample in closed form,
//! the sampled delay included. The describing function's own answer stands beside.

#[path = "common/naming.rs"]
mod naming;

use backdrive_control::operator::Intent;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Overrides, Settings};
use backdrive_plant::model::{Fragment, Model};
use backdrive_stability::outcome::Outcome;
use backdrive_stability::resimulate::{Gain, RunOptions, Scenario};
use naming::assert_names;
use std::f64::consts::PI;
use std::path::Path;
use std::sync::atomic::AtomicBool;

const RATE_HZ: f64 = 10_000.0;
const T: f64 = 1.0 / RATE_HZ;

/// A loop of a master and a slave with what it touches, without a hand: a pulse on the force channel starts it.
struct Loop {
    master: String,
    slave: String,
    environment: String,
    lambda: f64,
    /// Steps of delay on the contact force.
    delay: u64,
    duration_s: f64,
}

/// The pulse lasts this number of steps.
const PULSE_STEPS: usize = 100;

impl Loop {
    fn scenario(&self, pulse: f64) -> Scenario {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("launch/contact.toml");
        let none = || Some("none".into());
        let changes = Overrides { canceller: none(), rate_hz: Some(RATE_HZ), duration_s: Some(self.duration_s), ..Overrides::default() };
        let mut graph = Graph::load(&path, &changes).unwrap();
        let files = |model: &str, fragment: Option<&str>| DeviceFiles {
            model: Some(Model::from_toml(model, "device.toml").unwrap()),
            fragment: fragment.map(|text| Fragment::from_toml(text, "environment.toml").unwrap()),
            substeps: None,
            real_sensors: false,
            grip_changes: Vec::new(),
        };
        for node in &mut graph.nodes {
            match &mut node.settings {
                Settings::Master(master) => *master = files(&self.master, None),
                Settings::Slave(slave) => *slave = files(&self.slave, Some(&self.environment)),
                Settings::Scaling { dither, .. } => {
                    let mut force = vec![0.0; (self.duration_s * RATE_HZ) as usize];
                    force[..PULSE_STEPS].fill(pulse);
                    *dither = vec![force];
                }
                _ => {}
            }
        }
        for connection in graph.connections.iter_mut().filter(|c| c.to.1 == "contact") {
            connection.delay = self.delay;
        }
        assert_eq!(graph.node_of(NodeKind::Master).unwrap().axes, 1);
        Scenario::new(graph, Some(vec![Intent::Rest]), None).unwrap()
    }

    fn outcome(&self, pulse: f64) -> Outcome {
        let options = RunOptions { keep_dither: true, ..RunOptions::default() };
        let gain = Gain { mu: 1.0, lambda: self.lambda };
        self.scenario(pulse).run(gain, &options, &AtomicBool::new(false)).unwrap().outcome
    }
}

fn device(bodies: &str, elements: &str, on: &str, kind: &str, user: &str, measured: &str) -> String {
    format!(
        r#"
        name = "device"
        [bodies]
        {bodies}
        {elements}
        [[inputs]]
        name = "drive"
        kind = "{kind}"
        on = "{on}"
        hold = "{}"
        [[outputs]]
        name = "position"
        kind = "position"
        of = "{measured}"
        [[axes]]
        name = "forward"
        user = "{user}"
        feedback = "drive"
        measured = "position"
        "#,
        if kind == "force" { "zero" } else { "linear" }
    )
}

fn element(name: &str, kind: &str, between: [&str; 2], numbers: &str) -> String {
    format!("[[elements]]\nname = \"{name}\"\nkind = \"{kind}\"\nbetween = [\"{}\", \"{}\"]\n{numbers}\n", between[0], between[1])
}

fn fragment(element: &str) -> String {
    format!("name = \"environment\"\nkind = \"fragment\"\n{element}")
}

/// A slave that is exactly at its command: what it touches is all that it adds to the loop.
fn ideal_slave() -> String {
    device("tip = 0.0", "", "tip", "motion", "tip", "tip")
}

/// Half the peak-to-peak and the frequency over whole periods of the last half, from upward crossings of the middle.
fn measure(signal: &[f64]) -> (f64, f64) {
    let piece = &signal[signal.len() / 2..];
    let (low, high) = piece.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let middle = 0.5 * (low + high);
    let crossings: Vec<f64> = (1..piece.len())
        .filter(|i| piece[i - 1] < middle && piece[*i] >= middle)
        .map(|i| i as f64 - (piece[i] - middle) / (piece[i] - piece[i - 1]))
        .collect();
    let periods = (crossings.len() - 1) as f64;
    (0.5 * (high - low), periods / ((crossings[crossings.len() - 1] - crossings[0]) * T))
}

/// `m x'' + b x' + k x = u`, u constant over a step, in closed form (underdamped).
struct Oscillator {
    mass: f64,
    damping: f64,
    stiffness: f64,
}

impl Oscillator {
    fn step(&self, (x, v): (f64, f64), u: f64, dt: f64) -> (f64, f64) {
        let decay = self.damping / (2.0 * self.mass);
        let ring = (self.stiffness / self.mass - decay * decay).sqrt();
        let rest = u / self.stiffness;
        let (sin, cos) = (ring * dt).sin_cos();
        let fade = (-decay * dt).exp();
        let a = x - rest;
        let b = (v + decay * a) / ring;
        (rest + fade * (a * cos + b * sin), fade * (v * cos - (decay * v + (decay * decay + ring * ring) * a) / ring * sin))
    }

    fn toml(&self) -> String {
        let spring = element("spring", "spring", ["handle", "ground"], &format!("stiffness = {:?}", self.stiffness));
        let damper = element("damper", "damper", ["handle", "ground"], &format!("damping = {:?}", self.damping));
        device(&format!("handle = {:?}", self.mass), &(spring + &damper), "handle", "force", "handle", "handle")
    }
}

fn assert_close(what: &str, found: f64, known: f64, tolerance: f64) {
    println!("{what}: {found:.6}, known {known:.6} ({:+.2} %)", (found / known - 1.0) * 100.0);
    assert!((found / known - 1.0).abs() < tolerance, "{what}: {found} against {known}");
}

fn limit_cycle(outcome: Outcome) -> (f64, f64) {
    let Outcome::LimitCycle { amplitude_m, frequency_hz, .. } = outcome else { panic!("not a limit cycle: {outcome:?}") };
    (amplitude_m, frequency_hz)
}

#[test]
fn a_relay_in_the_loop() {
    // 36 to 82 Hz.
    [30, 50, 70].into_iter().for_each(relay);
}

/// The slave rubs on dry friction, and the master feels it late: F_f = -lambda c sgn(v(t - tau)), relay feedback of a delayed velocity.
fn relay(delay: u64) {
    let (master, level, lambda) = (Oscillator { mass: 0.1, damping: 0.5, stiffness: 400.0 }, 0.5, 1.0);
    let rubs = fragment(&element("rub", "coulomb", ["port", "ground"], &format!("force = {level:?}")));
    let found = Loop { master: master.toml(), slave: ideal_slave(), environment: rubs, lambda, delay, duration_s: 3.0 }.outcome(2.0);
    let (amplitude, frequency) = limit_cycle(found);

    // The sampled loop, exactly: the force of step k comes of the way from sample k - delay - 1 to k - delay.
    let mut state = (0.0, 0.0);
    let (mut positions, mut forces) = (vec![0.0], vec![0.0]);
    for k in 1..30_000_usize {
        state = master.step(state, if k <= PULSE_STEPS { 2.0 } else { 0.0 } + forces[k - 1], T);
        positions.push(state.0);
        let late = k.saturating_sub(delay as usize);
        let way = if late == 0 { 0.0 } else { positions[late] - positions[late - 1] };
        forces.push(if way == 0.0 { 0.0 } else { -lambda * level * way.signum() });
    }
    let (known_amplitude, known_frequency) = measure(&positions);
    assert_close("relay, amplitude", amplitude, known_amplitude, 0.03);
    assert_close("relay, frequency", frequency, known_frequency, 0.03);

    // Hamel's condition in continuous time: a square wave of half-period h, held from sample to sample, is on average a step late, so that tau =
    // (delay + 1) T. Then x(h) = -x(0), v(h) = -v(0), and the velocity is 0 at tau before each switch.
    let tau = (delay + 1) as f64 * T;
    let switch_velocity = |half: f64| {
        let start = antiperiodic(&master, lambda * level, half);
        (start, master.step(start, lambda * level, half - tau).1)
    };
    // Force and velocity late by tau are of opposite sign: the half wave of +F begins while the delayed velocity turns negative.
    let (mut low, mut high) = (tau * 1.05, tau * 3.9);
    let rising = switch_velocity(high).1 > switch_velocity(low).1;
    assert!(switch_velocity(low).1 * switch_velocity(high).1 < 0.0);
    while high - low > 1e-9 {
        let middle = 0.5 * (low + high);
        if (switch_velocity(middle).1 > 0.0) == rising { high = middle } else { low = middle }
    }
    let (start, _) = switch_velocity(low);
    let peak = (0..=1000).map(|i| master.step(start, lambda * level, low * f64::from(i) / 1000.0).0.abs()).fold(0.0, f64::max);
    assert_close("relay, frequency after Hamel", frequency, 0.5 / low, 0.03);
    assert_close("relay, amplitude after Hamel", amplitude, peak, 0.03);
}

/// The state at the start of a half wave of `+force` for which the half wave ends in its opposite.
fn antiperiodic(oscillator: &Oscillator, force: f64, half: f64) -> (f64, f64) {
    // s(h) = A s + c, so s = -(1 + A)^-1 c.
    let c = oscillator.step((0.0, 0.0), force, half);
    let column = |x: f64, v: f64| {
        let end = oscillator.step((x, v), 0.0, half);
        (end.0, end.1)
    };
    let ((a11, a21), (a12, a22)) = (column(1.0, 0.0), column(0.0, 1.0));
    let (p, q, r, s) = (1.0 + a11, a12, a21, 1.0 + a22);
    let det = p * s - q * r;
    (-(s * c.0 - q * c.1) / det, -(p * c.1 - r * c.0) / det)
}

/// A mass that slides on dry friction under a constant force, exactly: parabolas, turns and rests inside a step.
fn slide(mass: f64, friction: f64, (mut x, mut v): (f64, f64), u: f64, dt: f64) -> (f64, f64) {
    let mut left = dt;
    for _ in 0..4 {
        if v == 0.0 && u.abs() <= friction {
            return (x, 0.0);
        }
        let side = if v != 0.0 { v.signum() } else { u.signum() };
        let a = (u - side * friction) / mass;
        let stops_after = if a * side < 0.0 { -v / a } else { f64::INFINITY };
        let time = left.min(stops_after);
        x += v * time + 0.5 * a * time * time;
        v = if stops_after <= left { 0.0 } else { v + a * time };
        left -= time;
        if left <= 0.0 {
            break;
        }
    }
    (x, v)
}

#[test]
fn dry_friction_holds_a_delayed_wall_up_to_a_threshold() {
    let (mass, friction, stiffness, lambda, delay, duration_s) = (0.1, 0.1, 1000.0, 1.0, 10, 3.0);
    let rubs = element("friction", "coulomb", ["handle", "ground"], &format!("force = {friction:?}"));
    let wall = fragment(&element("wall", "spring", ["port", "ground"], &format!("stiffness = {stiffness:?}")));
    let master = device(&format!("handle = {mass:?}"), &rubs, "handle", "force", "handle", "handle");
    let product = Loop { master, slave: ideal_slave(), environment: wall, lambda, delay, duration_s };

    let exact = |pulse: f64| {
        let mut state = (0.0, 0.0);
        let mut positions = vec![0.0];
        for k in 1..(duration_s * RATE_HZ) as usize {
            let felt = (k - 1).checked_sub(delay as usize).map_or(0.0, |late| -lambda * stiffness * positions[late]);
            state = slide(mass, friction, state, felt + if k <= PULSE_STEPS { pulse } else { 0.0 }, T);
            positions.push(state.0);
        }
        positions
    };
    // A small pulse dies, a large one grows; in between lies the one that does neither for the whole run.
    let (mut low, mut high) = (0.2, 20.0); // N
    assert_eq!(product.outcome(low), Outcome::Stable);
    assert!(matches!(product.outcome(high), Outcome::Unstable { growth_per_s } if growth_per_s > 1.0));
    let mut between = None;
    while between.is_none() && high - low > 1e-12 * high {
        let middle = 0.5 * (low + high);
        match product.outcome(middle) {
            Outcome::Stable => low = middle,
            Outcome::Unstable { .. } => high = middle,
            outcome => between = Some((middle, limit_cycle(outcome))),
        }
    }
    let (pulse, (amplitude, frequency)) = between.expect("a pulse that neither dies nor grows");

    let (mut low, mut high) = (0.2, 20.0);
    while high - low > 1e-13 * high {
        let middle = 0.5 * (low + high);
        let positions = exact(middle);
        let last = positions[positions.len() - 2000..].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let before = positions[2000..4000].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        if last > before { high = middle } else { low = middle }
    }
    let dwells = exact(low);
    let (known_amplitude, known_frequency) = measure(&dwells[..dwells.len() / 2]);
    assert_close("threshold pulse", pulse, low, 0.03);
    assert_close("threshold, amplitude", amplitude, known_amplitude, 0.03);
    assert_close("threshold, frequency", frequency, known_frequency, 0.03);
    // The describing function: the wall feeds in pi K A^2 sin(w tau) per cycle, friction takes 4 c A; half a step of hold.
    let tau = (delay as f64 + 0.5) * T;
    let omega = 2.0 * PI * known_frequency;
    assert_close("threshold, 4c/(pi K sin(w tau))", amplitude, 4.0 * friction / (PI * lambda * stiffness * (omega * tau).sin()), 0.03);
    assert_close(
        "threshold, sqrt(K cos(w tau)/m)/2 pi",
        frequency,
        (lambda * stiffness * (omega * tau).cos() / mass).sqrt() / (2.0 * PI),
        0.03,
    );
}

#[test]
fn backlash_in_the_slave_s_drive() {
    // The drive takes the tip along through a gap; the tip stays where it is left, for it rubs more than the wall's spring pulls.
    let (master, delay, duration_s) = (Oscillator { mass: 0.1, damping: 2.0, stiffness: 200.0 }, 1, 4.0);
    let (gap, shaft, tip_friction, wall, lambda) = (4e-4, 1e5, 0.5, 100.0, 10.0);
    let elements = element("gear", "backlash", ["motor", "tip"], &format!("gap = {gap:?}\nstiffness = {shaft:?}\ndamping = 60.0"))
        + &element("seal", "coulomb", ["tip", "ground"], &format!("force = {tip_friction:?}"));
    let slave = device("motor = 0.0\ntip = 0.02", &elements, "motor", "motion", "tip", "tip");
    let environment = fragment(&element("wall", "spring", ["port", "ground"], &format!("stiffness = {wall:?}")));
    let product = Loop { master: master.toml(), slave, environment, lambda, delay, duration_s };
    let (amplitude, frequency) = limit_cycle(product.outcome(8.0));

    // Play: the tip moves when the drive is ahead by half the gap and the shaft is twisted enough for friction and wall.
    let ratio = shaft / (shaft + wall);
    let play = |tip: f64, drive: f64| {
        let pushed = |side: f64| ratio * (drive - side * 0.5 * gap) - side * tip_friction / (shaft + wall);
        tip.clamp(pushed(1.0), pushed(-1.0))
    };
    let mut state = (0.0, 0.0);
    let (mut positions, mut forces, mut tip) = (vec![0.0], vec![0.0], 0.0);
    for k in 1..(duration_s * RATE_HZ) as usize {
        let felt = (k - 1).checked_sub(delay as usize).map_or(0.0, |late| forces[late]);
        state = master.step(state, felt + if k <= PULSE_STEPS { 8.0 } else { 0.0 }, T);
        positions.push(state.0);
        tip = play(tip, state.0);
        forces.push(-lambda * wall * tip);
    }
    let (known_amplitude, known_frequency) = measure(&positions);
    assert_close("backlash, amplitude", amplitude, known_amplitude, 0.03);
    assert_close("backlash, frequency", frequency, known_frequency, 0.03);

    // The describing function of play (Gelb & Vander Velde 1968): the loop feeds in 4 K g (A - g) per cycle and the damper takes pi b w A^2. Here g
    // is half the gap, and K g' stands for the delay. The larger root is the stable cycle. Near, not within 3 %: the force of play is far from a
    // sine.
    let k = lambda * wall * ratio;
    let g = 0.5 * gap + tip_friction / shaft;
    let omega = 2.0 * PI * known_frequency;
    let taken = PI * (master.damping * omega - k * (omega * 1.5 * T).sin());
    let root = (4.0 * k * g + (16.0 * k * k * g * g - 16.0 * taken * k * g * g).sqrt()) / (2.0 * taken);
    assert_close("backlash, describing function", amplitude, root, 0.1);
    // Without the gap, and without the friction that twists the shaft, the same loop is stable: the cycle is the play's.
    let tight = product.slave.replace("gap = 0.0004", "gap = 0.0").replace("force = 0.5", "force = 0.0");
    assert_names(&tight, &["gap = 0.0\n", "force = 0.0\n"]);
    let tight = Loop { slave: tight, ..product };
    assert_eq!(tight.outcome(8.0), Outcome::Stable);
}
