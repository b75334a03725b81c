//! What a sensor adds: gain, delay, offset, noise, resolution.

use super::instant::Endpoint;
use super::sensor::Sensor;
use super::state::Plant;
use crate::model::OutputKind;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

impl Plant {
    /// Outputs now, in the order and units of the model: gain, delay, offset, then noise and resolution if the options
    /// say so. Values beyond `values` are dropped, what is beyond the outputs is left alone.
    pub fn outputs(&mut self, values: &mut [f64]) {
        if !self.sense.needs_balance {
            return self.read(values, None);
        }
        let Some(mut now) = self.instant.take() else { return };
        self.balance(&mut now);
        self.read(values, Some(&now));
        self.instant = Some(now);
    }

    fn read(&mut self, values: &mut [f64], now: Option<&Endpoint>) {
        for (index, value) in values.iter_mut().enumerate().take(self.sense.sensors.len()) {
            let sensor = &self.sense.sensors[index];
            let raw = if sensor.delay > 0.0 { sensor.delayed(self.sense.noted) } else { self.reading(sensor, now) };
            *value = sensor.gain * raw + sensor.offset;
            let (noise, resolution) = (sensor.noise, sensor.resolution);
            if noise > 0.0
                && let Some(random) = &mut self.sense.random
            {
                let sample: f64 = StandardNormal.sample(random);
                *value += noise * sample;
            }
            if self.sense.quantise && resolution > 0.0 {
                *value = resolution * (*value / resolution + 0.5).floor();
            }
        }
    }

    /// Number of outputs.
    pub fn output_count(&self) -> usize {
        self.sense.sensors.len()
    }

    fn reading(&self, sensor: &Sensor, now: Option<&Endpoint>) -> f64 {
        match (&sensor.what, now) {
            (OutputKind::Position(_), _) => self.x[sensor.slot],
            (OutputKind::Velocity(_), _) => self.v[sensor.slot],
            (OutputKind::Acceleration(_), Some(now)) => now.acceleration[sensor.slot],
            (OutputKind::Force(elements), now) => elements.iter().map(|element| self.force_with(*element, now)).sum(),
            (OutputKind::Reaction(_), Some(now)) => self.reaction_at(sensor.slot, now),
            (_, None) => f64::NAN,
        }
    }

    fn force_with(&self, element: usize, now: Option<&Endpoint>) -> f64 {
        match now {
            Some(now) => self.force_at(element, now),
            None => self.force_without_balance(element).unwrap_or(f64::NAN),
        }
    }

    /// Notes the values of delayed outputs.
    pub(super) fn note_outputs(&mut self) {
        let now = if self.sense.delayed_balance { self.instant.take() } else { None }.map(|mut now| {
            self.balance(&mut now);
            now
        });
        let noted = self.sense.noted;
        for index in 0..self.sense.sensors.len() {
            let sensor = &self.sense.sensors[index];
            if sensor.delay > 0.0 {
                let value = self.reading(sensor, now.as_deref());
                let past = &mut self.sense.sensors[index].past;
                let len = past.len();
                past[noted % len] = value;
            }
        }
        self.sense.noted += 1;
        self.instant = now.or(self.instant.take());
    }

    pub(super) fn restart_sense(&mut self) {
        self.sense.noted = 0;
        self.sense.random = self.sense.seed.map(ChaCha8Rng::seed_from_u64);
        if self.sense.delayed {
            self.note_outputs();
        }
    }
}
