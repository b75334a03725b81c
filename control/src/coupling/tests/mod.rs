//! Tests of what the laws guarantee: energy, closed forms, bounds.

mod energy;
mod line;
mod node;
mod transparency;
mod virtual_wall;

use super::{Far, Near, Own, Packet};

/// One way of a link: a constant delay of whole steps, evenly distributed further steps, loss; a packet that was overtaken is dropped.
struct Way {
    delay: u64,
    jitter: u64,
    loss: f64,
    random: u64,
    flying: Vec<(u64, u64, Packet)>,
    newest: Option<u64>,
}

impl Way {
    fn new(delay: u64, jitter: u64, loss: f64, seed: u64) -> Way {
        Way { delay, jitter, loss, random: seed, flying: Vec::new(), newest: None }
    }

    fn constant(delay: u64) -> Way {
        Way::new(delay, 0, 0.0, 1)
    }

    /// Even in [0, 1).
    fn draw(&mut self) -> f64 {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.random >> 33) as f64 / f64::from(1_u32 << 31)
    }

    fn send(&mut self, step: u64, packet: Packet) {
        let (lost, further) = (self.draw() < self.loss, ((self.jitter + 1) as f64 * self.draw()) as u64);
        if !lost {
            self.flying.push((step + self.delay + further, step, packet));
        }
    }

    fn take(&mut self, step: u64) -> Option<Packet> {
        let newest = self.newest;
        let due = |f: &&(u64, u64, Packet)| f.0 <= step && newest.is_none_or(|n| f.1 > n);
        let found = self.flying.iter().filter(due).max_by_key(|f| f.1).copied();
        self.flying.retain(|f| f.0 > step);
        let (_, sent, packet) = found?;
        self.newest = Some(sent);
        Some(packet)
    }
}

/// Links that every law is tried on: (delay there, delay back, jitter, loss), in steps.
const LINKS: [(u64, u64, u64, f64); 5] = [(0, 1, 0, 0.0), (40, 60, 0, 0.0), (200, 200, 0, 0.0), (80, 80, 80, 0.0), (30, 30, 20, 0.3)];

/// The response of a law to a given motion of the master, with a slave that follows its command at once and feels `contact` of (position, velocity).
/// Per step: (master's velocity, force on the master, slave's velocity, force on the slave).
fn driven(
    near: &mut dyn Near,
    far: &mut dyn Far,
    link: (u64, u64, u64, f64),
    period_s: f64,
    motion: &[f64],
    contact: impl Fn(f64, f64) -> f64,
) -> Vec<[f64; 4]> {
    let (mut there, mut back) = (Way::new(link.0, link.2, link.3, 7), Way::new(link.1, link.2, link.3, 11));
    let (mut tip, mut speed, mut before) = (0.0, 0.0, motion.first().copied().unwrap_or(0.0));
    let mut rows = Vec::new();
    for (step, position) in motion.iter().enumerate() {
        let step = step as u64;
        let (moved, heard) = (position - before, back.take(step));
        before = *position;
        let own = Own { position: *position, velocity: moved / period_s, moved, force: 0.0, power_scale: 1.0 };
        let (force, packet) = near.step(&own, heard.as_ref(), period_s);
        there.send(step, packet);
        let felt = contact(tip, speed);
        let own = Own { position: tip, velocity: speed, moved: speed * period_s, force: felt, power_scale: 1.0 };
        let (command, packet) = far.step(&own, there.take(step).as_ref(), period_s);
        back.send(step, packet);
        (speed, tip) = ((command - tip) / period_s, command);
        rows.push([moved / period_s, force, speed, felt]);
    }
    rows
}

/// A motion with free way, contact and shaking in it, m.
fn shaken(steps: usize, period_s: f64) -> Vec<f64> {
    let at = |t: f64| 0.006 * (1.0 - (3.0 * t).cos()) + 0.001 * (40.0 * t).sin() * (0.7 * t).sin();
    (0..steps).map(|step| at(step as f64 * period_s)).collect()
}
