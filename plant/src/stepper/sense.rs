//! What a sensor adds: gain, delay, offset, noise, resolution.

use super::endpoint::Endpoint;
use super::{Options, Plant};
use crate::model::{Model, OutputKind};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A sensor.
#[derive(Debug, Clone)]
struct Sensor {
    what: OutputKind,
    /// Place of the body that it reads.
    slot: usize,
    gain: f64,
    offset: f64,
    resolution: f64,
    noise: f64,
    /// Delay in substeps.
    delay: f64,
    /// Values at the last substeps, as a ring; empty without delay.
    past: Vec<f64>,
}

/// All sensors of a plant.
#[derive(Debug, Clone)]
pub(super) struct Sense {
    sensors: Vec<Sensor>,
    /// Values noted since the start.
    noted: usize,
    quantise: bool,
    seed: Option<u64>,
    random: Option<ChaCha8Rng>,
    needs_forces: bool,
    delayed: bool,
    delayed_forces: bool,
}

/// Whether a reading needs the balance of forces.
fn is_force(what: &OutputKind) -> bool {
    matches!(what, OutputKind::Acceleration(_) | OutputKind::Force(_) | OutputKind::Reaction(_))
}

impl Sense {
    pub(super) fn new(model: &Model, slots: &[usize], substep: f64, options: &Options) -> Sense {
        let sensors: Vec<Sensor> = model
            .outputs
            .iter()
            .map(|output| {
                let delay = output.delay / substep;
                let slot = match &output.kind {
                    OutputKind::Position(body)
                    | OutputKind::Velocity(body)
                    | OutputKind::Acceleration(body)
                    | OutputKind::Reaction(body) => slots.get(*body).copied().unwrap_or(super::GROUND),
                    OutputKind::Force(_) => super::GROUND,
                };
                Sensor {
                    what: output.kind.clone(),
                    slot,
                    gain: output.gain,
                    offset: output.offset,
                    resolution: output.resolution,
                    noise: output.noise,
                    delay,
                    past: if delay > 0.0 { vec![0.0; delay.ceil() as usize + 4] } else { Vec::new() },
                }
            })
            .collect();
        Sense {
            noted: 0,
            quantise: options.quantise,
            seed: options.add_noise,
            random: None,
            needs_forces: sensors.iter().any(|sensor| is_force(&sensor.what)),
            delayed: sensors.iter().any(|sensor| sensor.delay > 0.0),
            delayed_forces: sensors.iter().any(|sensor| sensor.delay > 0.0 && is_force(&sensor.what)),
            sensors,
        }
    }

    /// Whether values have to be noted after each substep.
    #[inline]
    pub(super) fn watches_substeps(&self) -> bool {
        self.delayed
    }
}

impl Sensor {
    /// The value `delay` substeps ago: a cubic through four values for positions and velocities, a line for forces, which may jump.
    fn delayed(&self, noted: usize) -> f64 {
        let len = self.past.len();
        let whole = self.delay.floor();
        let share = self.delay - whole;
        let newest = noted.saturating_sub(1);
        // Counted backwards from the newest; before the start the first value stands.
        let at = |back: usize| self.past[newest.saturating_sub(back) % len];
        let back = whole as usize;
        if share == 0.0 {
            return at(back);
        }
        let (a, b) = (at(back), at(back + 1));
        if is_force(&self.what) || back == 0 || back + 2 > newest {
            return a + share * (b - a);
        }
        // Lagrange through the values at -1, 0, 1, 2, of which share lies between 0 and 1.
        let (before, after, t) = (at(back - 1), at(back + 2), share);
        -t * (t - 1.0) * (t - 2.0) / 6.0 * before + (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0 * a - (t + 1.0) * t * (t - 2.0) / 2.0 * b
            + (t + 1.0) * t * (t - 1.0) / 6.0 * after
    }
}

impl Plant {
    /// Outputs now, in the order and units of the model: gain, delay, offset, then noise and resolution if the options
    /// say so. Values beyond `values` are dropped, what is beyond the outputs is left alone.
    pub fn outputs(&mut self, values: &mut [f64]) {
        let now = if self.sense.needs_forces { self.instant.take() } else { None }.map(|mut now| {
            self.balance(&mut now);
            now
        });
        for (index, value) in values.iter_mut().enumerate().take(self.sense.sensors.len()) {
            let sensor = &self.sense.sensors[index];
            let raw = if sensor.delay > 0.0 { sensor.delayed(self.sense.noted) } else { self.reading(sensor, now.as_deref()) };
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
        self.instant = now.or(self.instant.take());
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
            (OutputKind::Force(elements), Some(now)) => elements.iter().map(|element| self.force_at(*element, now)).sum(),
            (OutputKind::Reaction(_), Some(now)) => self.reaction_at(sensor.slot, now),
            (_, None) => f64::NAN,
        }
    }

    /// Notes the values of delayed outputs.
    pub(super) fn note_outputs(&mut self) {
        let now = self.sense.delayed_forces.then(|| self.endpoint());
        let noted = self.sense.noted;
        for index in 0..self.sense.sensors.len() {
            let sensor = &self.sense.sensors[index];
            if sensor.delay > 0.0 {
                let value = self.reading(sensor, now.as_ref());
                let past = &mut self.sense.sensors[index].past;
                let len = past.len();
                past[noted % len] = value;
            }
        }
        self.sense.noted += 1;
    }

    pub(super) fn restart_sense(&mut self) {
        self.sense.noted = 0;
        self.sense.random = self.sense.seed.map(ChaCha8Rng::seed_from_u64);
        if self.sense.delayed {
            self.note_outputs();
        }
    }
}
