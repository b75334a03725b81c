//! A dynamometer: a static map of the wanted torque, then one linear system of second order for every operating point.

use crate::core::{Core, Events, Port, Tick};
use crate::freshness::Freshness;
use backdrive_msgs::{Sample, flag};
use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What a dynamometer is: Blumenschein et al., Fig. 3, with the second order of Tallfors 2005 for converter and machine together.
#[derive(Debug, Clone, PartialEq)]
pub struct DynamometerModel {
    /// Points (wanted torque, static torque), N m, the first rising; linear in between, and on beyond them with their last slopes. Without
    /// points what is wanted is what comes.
    pub map: Vec<[f64; 2]>,
    /// Natural frequency, Hz, above 0.
    pub frequency_hz: f64,
    /// Damping ratio, above 0.
    pub damping_ratio: f64,
    /// Delay from the wanted torque to the machine, s, rounded to whole periods.
    pub delay_s: f64,
    /// Most power, W: above it the torque is cut. Infinite without a limit.
    pub power: f64,
}

impl DynamometerModel {
    /// The static torque of a wanted one, N m.
    pub fn static_torque(&self, wanted: f64) -> f64 {
        let points = &self.map;
        if points.len() < 2 {
            return points.first().map_or(wanted, |p| wanted + p[1] - p[0]);
        }
        let axis = |i: usize| points[i][0];
        let last = points.len() - 1;
        let index = points.iter().rposition(|p| p[0] <= wanted).unwrap_or(0).min(last - 1);
        let share = (wanted - axis(index)) / (axis(index + 1) - axis(index));
        points[index][1] + share * (points[index + 1][1] - points[index][1])
    }
}

/// The machine in time.
#[derive(Debug, Clone)]
pub struct Dynamometer {
    model: DynamometerModel,
    /// Torque and its rate from period to period under a held static torque.
    step: [[f64; 3]; 2],
    state: [f64; 2],
    /// Wanted torques on their way, as a ring.
    waiting: Vec<f64>,
    place: usize,
}

impl Dynamometer {
    /// A machine that gives no torque yet.
    pub fn new(model: DynamometerModel, period_s: f64) -> Dynamometer {
        let w = std::f64::consts::TAU * model.frequency_hz;
        let rates = [0.0, 1.0, 0.0, -w * w, -2.0 * model.damping_ratio * w, w * w, 0.0, 0.0, 0.0];
        let all = (DMatrix::from_row_slice(3, 3, &rates) * period_s).exp();
        let row = |i: usize| [all[(i, 0)], all[(i, 1)], all[(i, 2)]];
        let periods = (model.delay_s / period_s).round().max(0.0) as usize;
        Dynamometer { model, step: [row(0), row(1)], state: [0.0; 2], waiting: vec![0.0; periods], place: 0 }
    }

    /// Advances by one period with a wanted torque, N m, at a speed, rad/s, and gives the torque at its end, N m, and whether the limit of
    /// power acted.
    pub fn step(&mut self, wanted: f64, speed: f64) -> (f64, bool) {
        let due = match self.waiting.get_mut(self.place) {
            Some(slot) => std::mem::replace(slot, wanted),
            None => wanted,
        };
        self.place = if self.waiting.is_empty() { 0 } else { (self.place + 1) % self.waiting.len() };
        let asked = self.model.static_torque(due);
        let most = self.model.power / speed.abs().max(1e-3);
        let held = asked.clamp(-most, most);
        let [torque, rate] = self.state;
        let next = |row: [f64; 3]| row[0] * torque + row[1] * rate + row[2] * held;
        self.state = [next(self.step[0]), next(self.step[1])];
        (self.state[0], held != asked)
    }

    /// The torque without noise, N m.
    pub fn torque(&self) -> f64 {
        self.state[0]
    }
}

/// Inputs `command` (effort), `measured` (velocity of its rotor); outputs `torque` (effort on the shaft from this step to the next), `measured`
/// (effort as the converter estimates it, with its noise).
pub struct DynamometerNode {
    machine: Dynamometer,
    noise: f64,
    random: ChaCha8Rng,
    command: Freshness,
    speed: Freshness,
    held: [f64; 2],
}

impl DynamometerNode {
    /// `noise` is the deviation of the converter's estimate, N m, 0 or above.
    pub fn new(machine: Dynamometer, noise: f64, seed: u64) -> DynamometerNode {
        let random = ChaCha8Rng::seed_from_u64(seed);
        DynamometerNode { machine, noise, random, command: Freshness::default(), speed: Freshness::default(), held: [0.0; 2] }
    }
}

impl Core for DynamometerNode {
    fn step(&mut self, _tick: &Tick, inputs: &[Port], outputs: &mut [Sample], _events: &mut Events) {
        if let Some(sample) = self.command.new_sample(&inputs[0], |s| s.effort[0]) {
            self.held[0] = sample.effort[0];
        }
        if let Some(sample) = self.speed.new_sample(&inputs[1], |s| s.velocity[0]) {
            self.held[1] = sample.velocity[0];
        }
        let (torque, limited) = self.machine.step(self.held[0], self.held[1]);
        let (on_shaft, estimate) = outputs.split_at_mut(1);
        let draw: f64 = StandardNormal.sample(&mut self.random);
        for axis in 0..on_shaft[0].len() {
            on_shaft[0].effort[axis] = torque;
            estimate[0].effort[axis] = torque + self.noise * draw;
        }
        on_shaft[0].flags = if limited { flag::LIMITED } else { 0 };
    }
}
