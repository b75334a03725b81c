//! A sensor at work: gain, delay, offset, noise, resolution.

use super::compiled::Share;
use super::options::Options;
use super::slots::GROUND;
use crate::model::{Model, OutputKind};
use rand_chacha::ChaCha8Rng;

/// A sensor.
#[derive(Debug, Clone)]
pub(super) struct Sensor {
    pub(super) what: OutputKind,
    /// Place of the body that it reads.
    pub(super) slot: usize,
    pub(super) gain: f64,
    pub(super) offset: f64,
    pub(super) resolution: f64,
    pub(super) noise: f64,
    /// Delay in substeps.
    pub(super) delay: f64,
    /// Values at the last substeps, as a ring; empty without delay.
    pub(super) past: Vec<f64>,
}

/// All sensors of a plant.
#[derive(Debug, Clone)]
pub(super) struct Sense {
    pub(super) sensors: Vec<Sensor>,
    /// Values noted since the start.
    pub(super) noted: usize,
    pub(super) quantise: bool,
    pub(super) seed: Option<u64>,
    pub(super) random: Option<ChaCha8Rng>,
    /// Whether any reads a force or an acceleration.
    pub(super) reads_forces: bool,
    /// Whether any needs the balance of forces for it; whether a delayed one does.
    pub(super) needs_balance: bool,
    pub(super) delayed: bool,
    pub(super) delayed_balance: bool,
}

/// Whether a reading needs the balance of forces: accelerations do, and with them inerters and what sticks.
fn needs_balance(what: &OutputKind, elements: &[Share]) -> bool {
    let free_of_it =
        |share: Option<&Share>| matches!(share, Some(Share::Path(_))) || matches!(share, Some(Share::Linear(l, ..)) if l.inertance == 0.0);
    match what {
        OutputKind::Force(of) => !of.iter().all(|element| free_of_it(elements.get(*element))),
        _ => is_force(what),
    }
}

/// Whether a reading is a force or an acceleration, which may jump.
fn is_force(what: &OutputKind) -> bool {
    matches!(what, OutputKind::Acceleration(_) | OutputKind::Force(_) | OutputKind::Reaction(_))
}

impl Sense {
    pub(super) fn new(model: &Model, slots: &[usize], elements: &[Share], substep: f64, options: &Options) -> Sense {
        let balance = |sensor: &Sensor| needs_balance(&sensor.what, elements);
        let sensors: Vec<Sensor> = model
            .outputs
            .iter()
            .map(|output| {
                let delay = output.delay / substep;
                let slot = match &output.kind {
                    OutputKind::Position(body)
                    | OutputKind::Velocity(body)
                    | OutputKind::Acceleration(body)
                    | OutputKind::Reaction(body) => slots.get(*body).copied().unwrap_or(GROUND),
                    OutputKind::Force(_) => GROUND,
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
            reads_forces: sensors.iter().any(|sensor| is_force(&sensor.what)),
            needs_balance: sensors.iter().any(balance),
            delayed: sensors.iter().any(|sensor| sensor.delay > 0.0),
            delayed_balance: sensors.iter().any(|sensor| sensor.delay > 0.0 && balance(sensor)),
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
    pub(super) fn delayed(&self, noted: usize) -> f64 {
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
