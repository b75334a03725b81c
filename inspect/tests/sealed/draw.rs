//! Clean recordings of many kinds, from a seed.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// What a column is, for the corruption that may be put on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    Time,
    Command,
    Leader,
    Position,
    Velocity,
    Drive,
}

/// A column of a clean recording.
#[derive(Debug, Clone)]
pub struct Column {
    pub heading: String,
    pub joint: usize,
    pub role: Role,
    pub values: Vec<f64>,
}

/// A clean recording.
#[derive(Debug, Clone)]
pub struct Clean {
    pub kind: &'static str,
    pub rate: f64,
    pub columns: Vec<Column>,
}

pub struct Random(pub ChaCha8Rng);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(ChaCha8Rng::seed_from_u64(seed))
    }
    pub fn range(&mut self, from: f64, to: f64) -> f64 {
        self.0.random_range(from..to)
    }
    pub fn log(&mut self, from: f64, to: f64) -> f64 {
        self.range(from.ln(), to.ln()).exp()
    }
    pub fn below(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
    pub fn chance(&mut self, share: f64) -> bool {
        self.range(0.0, 1.0) < share
    }
}

/// A motion to be made: sines, steps with rests, or ramps with rests, at most `fastest` Hz.
fn wanted(random: &mut Random, rows: usize, period: f64, size: f64, fastest: f64) -> Vec<f64> {
    let waves: Vec<(f64, f64, f64)> =
        (0..3 + random.below(4)).map(|_| (random.log(0.05, fastest), random.range(0.0, TAU), random.range(0.3, 1.0))).collect();
    let sum: f64 = waves.iter().map(|w| w.2).sum();
    let wave = |t: f64| waves.iter().map(|(f, p, a)| a * (TAU * f * t + p).sin()).sum::<f64>() / sum;
    let kind = random.below(4);
    let (mut at, mut target, mut left, mut out) = (0.0, 0.0, 0.0, Vec::with_capacity(rows));
    let speed = random.range(0.4, 2.0);
    for row in 0..rows {
        let t = row as f64 * period;
        let value = match kind {
            0 | 1 => wave(t),
            _ => {
                left -= period;
                if left <= 0.0 {
                    (target, left) = (random.range(-1.0, 1.0), random.range(0.8, 2.5));
                }
                // Ramps at a constant speed, or steps that a planner rounds off.
                at +=
                    if kind == 2 { (target - at).clamp(-speed * period, speed * period) } else { (target - at) * (6.0 * period).min(1.0) };
                at
            }
        };
        out.push(size * value);
    }
    out
}

/// A second-order servo behind a dead time, with a droop under its weight.
fn servo(command: &[f64], period: f64, hz: f64, damping: f64, delay: f64, droop: f64) -> Vec<f64> {
    let (w, steps) = (TAU * hz, 8);
    let h = period / f64::from(steps);
    let late = (delay / period).round() as usize;
    let (mut x, mut v, mut out) = (command.first().copied().unwrap_or(0.0), 0.0, Vec::with_capacity(command.len()));
    for row in 0..command.len() {
        let target = command[row.saturating_sub(late)];
        out.push(x);
        for _ in 0..steps {
            v += h * (w * w * (target - droop * x.cos() - x) - 2.0 * damping * w * v);
            x += h * v;
        }
    }
    out
}

fn derivative(x: &[f64], period: f64) -> Vec<f64> {
    let last = x.len() - 1;
    (0..x.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            (x[b] - x[a]) / ((b - a) as f64 * period)
        })
        .collect()
}

/// The torque of a joint along a motion: inertia, viscous and dry friction, weight, a spring.
fn torque(random: &mut Random, x: &[f64], period: f64, spring: bool) -> Vec<f64> {
    let v = derivative(x, period);
    let a = derivative(&v, period);
    let size = |y: &[f64]| (y.iter().map(|y| y * y).sum::<f64>() / y.len() as f64).sqrt().max(1e-9);
    let (inertia, viscous, dry) = (random.range(0.3, 1.0) / size(&a), random.range(0.3, 1.0) / size(&v), random.range(0.1, 0.6));
    let weight = if spring { 0.0 } else { random.range(0.0, 1.0) };
    let stiffness = if spring { random.range(0.0, 1.0) / size(x) } else { 0.0 };
    let turn = 0.02 * size(&v);
    (0..x.len()).map(|i| inertia * a[i] + viscous * v[i] + dry * (v[i] / turn).tanh() + weight * x[i].sin() + stiffness * x[i]).collect()
}

fn noisy(random: &mut Random, x: &[f64], sd: f64) -> Vec<f64> {
    x.iter().map(|x| x + sd * random.normal()).collect()
}

fn rounded(x: &[f64], step: f64) -> Vec<f64> {
    x.iter().map(|x| (x / step).round() * step).collect()
}

fn size(x: &[f64]) -> f64 {
    x.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x)) - x.iter().fold(f64::INFINITY, |m, x| m.min(*x))
}

/// A clean recording from a seed.
pub fn clean(random: &mut Random) -> Clean {
    let kind = ["servo", "lever", "motor", "pair", "arm"][random.below(5)];
    let rate = match kind {
        "servo" => [50.0, 100.0, 200.0][random.below(3)],
        "arm" => [100.0, 125.0, 250.0][random.below(3)],
        "pair" => [100.0, 500.0, 1000.0][random.below(3)],
        _ => [250.0, 500.0, 1000.0][random.below(3)],
    };
    let (period, seconds) = (1.0 / rate, random.range(20.0, 30.0));
    let rows = (seconds * rate) as usize;
    let jitter = if random.chance(0.3) { random.range(0.0, 0.06) } else { 0.0 };
    let times = (0..rows).map(|i| (i as f64 + jitter * random.range(-0.5, 0.5)) * period).collect();
    let mut columns = vec![Column { heading: "t".to_string(), joint: 0, role: Role::Time, values: times }];
    let mut add = |heading: String, joint: usize, role: Role, values: Vec<f64>| columns.push(Column { heading, joint, role, values });
    let encoder = TAU / [4096.0, 16384.0, 65536.0][random.below(3)];
    match kind {
        "servo" | "arm" => {
            let joints = if kind == "servo" { 1 + random.below(2) } else { 3 + random.below(4) };
            let has_velocity = random.chance(0.6);
            let drive = if kind == "servo" { "current [A]" } else { "torque [N m]" };
            for joint in 0..joints {
                let size_of = random.range(0.4, 1.5);
                let command = wanted(random, rows, period, size_of, 1.5);
                let (hz, damping, droop) = (random.range(2.0, 8.0), random.range(0.5, 1.2), random.range(0.0, 0.03));
                let delay = random.range(0.01, 0.1);
                let x = servo(&command, period, hz, damping, delay, droop);
                let name = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_flex", "wrist_roll", "gripper"][joint];
                let drive_values = torque(random, &x, period, false);
                let (own, level) = (size(&drive_values), random.log(0.002, 0.03));
                add(format!("{name}.command"), joint, Role::Command, rounded(&command, 1e-5));
                let spread = encoder * random.range(0.1, 1.0);
                let measured = rounded(&noisy(random, &x, spread), encoder);
                add(format!("{name}.position"), joint, Role::Position, measured);
                if has_velocity {
                    let v = derivative(&x, period);
                    let spread = 0.005 * size(&v);
                    add(format!("{name}.velocity"), joint, Role::Velocity, noisy(random, &v, spread));
                }
                add(format!("{name}.{drive}"), joint, Role::Drive, noisy(random, &drive_values, level * own));
            }
        }
        "lever" | "motor" => {
            let is_lever = kind == "lever";
            let reach = if is_lever { random.log(0.01, 0.1) } else { random.range(0.5, 6.0) };
            let way = wanted(random, rows, period, reach, 3.0);
            let x = servo(&way, period, random.range(5.0, 12.0), 0.9, 0.0, 0.0);
            let force = torque(random, &x, period, is_lever);
            let spread = if is_lever { 2e-6 } else { 0.3 * encoder };
            let step = if is_lever { 5e-6 } else { encoder };
            let (a, b, c) =
                if is_lever { ("x [m]", "velocity [m/s]", "force [N]") } else { ("angle [rad]", "speed [rad/s]", "current [A]") };
            let measured = rounded(&noisy(random, &x, spread), step);
            add(a.to_string(), 0, Role::Position, measured);
            if random.chance(0.7) {
                let v = derivative(&x, period);
                let spread = 0.004 * size(&v);
                add(b.to_string(), 0, Role::Velocity, noisy(random, &v, spread));
            }
            let level = random.log(0.002, 0.03) * size(&force);
            add(c.to_string(), 0, Role::Drive, noisy(random, &force, level));
        }
        _ => {
            let reach = random.range(0.2, 1.0);
            let way = wanted(random, rows, period, reach, 2.0);
            let lead = servo(&way, period, 6.0, 0.9, 0.0, 0.0);
            let (hz, damping, delay) = (random.range(4.0, 15.0), random.range(0.6, 1.1), random.range(0.005, 0.08));
            let follow = servo(&lead, period, hz, damping, delay, 0.0);
            for (joint, (side, x)) in [("leader", lead), ("follower", follow)].into_iter().enumerate() {
                let role = if joint == 0 { Role::Leader } else { Role::Position };
                let measured = rounded(&noisy(random, &x, 0.4 * encoder), encoder);
                add(format!("{side}.position [rad]"), joint, role, measured);
                let v = derivative(&x, period);
                let spread = 0.004 * size(&v);
                add(format!("{side}.velocity [rad/s]"), joint, Role::Velocity, noisy(random, &v, spread));
                let force = torque(random, &x, period, true);
                let level = random.log(0.002, 0.03) * size(&force);
                add(format!("{side}.torque [N m]"), joint, Role::Drive, noisy(random, &force, level));
            }
        }
    }
    Clean { kind, rate, columns }
}
