//! What is measured at the end of a period.

use super::SealedPlant;
use crate::laws::Path;
use crate::network::{Output, OutputKind};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::VecDeque;

/// One output's sensor.
pub(super) struct Sensor {
    output: Output,
    noise: f64,
    random: ChaCha8Rng,
    /// The exact values that the delay still reaches, the newest last.
    past: VecDeque<f64>,
    /// Delay in periods.
    delay: f64,
}

impl Sensor {
    pub fn new(output: &Output, noise: f64, seed: u64, index: usize, period_s: f64) -> Sensor {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // A stream for each output: one that is added changes no other's noise.
        random.set_stream(index as u64);
        let delay = output.delay / period_s;
        Sensor { output: output.clone(), noise, random, past: vec![0.0; delay.ceil() as usize + 2].into(), delay }
    }

    /// The exact value (gain, delay between samples by a straight line, offset) and the measured one (noise, encoder step).
    fn read(&mut self, value: f64) -> (f64, f64) {
        self.past.pop_front();
        self.past.push_back(self.output.gain * value);
        let newest = self.past.len() - 1;
        let (whole, part) = (self.delay.floor() as usize, self.delay.fract());
        let delayed = self.past[newest - whole] * (1.0 - part) + self.past[newest - whole - usize::from(part > 0.0)] * part;
        let exact = delayed + self.output.offset;
        let drawn: f64 = StandardNormal.sample(&mut self.random);
        let noisy = exact + self.noise * drawn;
        let step = self.output.resolution;
        (exact, if step > 0.0 { (noisy / step).round() * step } else { noisy })
    }
}

impl SealedPlant {
    /// Forces and accelerations at the end of the period, then every output.
    pub(super) fn measure(&mut self) {
        self.scratch.copy_from_slice(&self.memory);
        self.applied.fill(0.0);
        for drive in &mut self.drives {
            let body = drive.body();
            if drive.is_motion() {
                self.accelerations[body] = drive.acceleration(1.0 / self.substeps as f64);
            } else {
                self.applied[body] += drive.force_now();
            }
        }
        for (index, joint) in self.joints.iter().enumerate() {
            // Half a substep has gone by since the memories were carried on. Friction is that of the last kick.
            let x = joint.relative(&self.positions);
            let v = joint.relative(&self.speeds);
            let path = Path { from: joint.last, to: x, speed: v, duration: 0.5 * self.substep_s };
            let remembered = &mut self.scratch[joint.memory.clone()];
            let along = joint.force.path_force(&path, remembered);
            let friction = joint.dry.map_or(0.0, |dry| self.kick.friction[dry]);
            let force = along + joint.force.damping(x, v, remembered) * v + friction;
            joint.push(force, &mut self.applied);
            self.element_forces[index] = force;
        }
        self.kick.accelerate(&self.applied, &mut self.accelerations, &mut self.reactions);
        for (index, joint) in self.joints.iter().enumerate() {
            let inertance = joint.force.inertance();
            if inertance > 0.0 {
                self.element_forces[index] += inertance * joint.relative(&self.accelerations);
            }
        }
        for (index, sensor) in self.sensors.iter_mut().enumerate() {
            let value = match &sensor.output.kind {
                OutputKind::Position(body) => self.positions[*body],
                OutputKind::Velocity(body) => self.speeds[*body],
                OutputKind::Acceleration(body) => self.accelerations[*body],
                OutputKind::Force(elements) => elements.iter().map(|element| self.element_forces[*element]).sum(),
                OutputKind::Reaction(body) => self.reactions[*body],
            };
            (self.exact[index], self.measured[index]) = sensor.read(value);
        }
    }
}
