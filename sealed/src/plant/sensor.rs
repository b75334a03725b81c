//! One output's sensor.

use crate::network::Output;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::VecDeque;

/// One output's sensor.
pub(super) struct Sensor {
    pub(super) output: Output,
    pub(super) noise: f64,
    pub(super) random: ChaCha8Rng,
    /// The exact values that the delay still reaches, the newest last.
    pub(super) past: VecDeque<f64>,
    /// Delay in periods.
    pub(super) delay: f64,
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
    pub fn read(&mut self, value: f64) -> (f64, f64) {
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
