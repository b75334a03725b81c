//! A truth drawn from a seed.
//!
//! Sizes come from what the nominal device does under its working force (`ranges`), never from what some program would find.

mod candidates;
mod mask;
mod options;
mod ranges;
mod sizes;
pub(crate) mod sizing;

pub use options::DrawOptions;

use crate::effects::Effect;
use crate::network::Network;
use crate::plant::PlantError;
use crate::truth::{Hand, SCHEMA, Sensor, Truth};
use candidates::Candidate;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use ranges::Probe;
use sizing::rounded;

/// Sizes of one candidate that are tried before another one is.
const TRIES_OF_SIZE: usize = 3;

/// Candidates that are tried for one effect.
const TRIES_OF_PLACE: usize = 40;

/// A truth that cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum DrawError {
    /// An option is out of range.
    #[error("{option} is {value}; give {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        expected: &'static str,
    },
    /// No effect that shows in the outputs has a place in this device.
    #[error("device \"{device}\" has no place for {effects} effects that show in its outputs; ask for fewer, or for linear ones too")]
    NoPlace {
        /// Its name.
        device: String,
        /// How many were asked for.
        effects: usize,
    },
    /// The nominal device itself cannot be simulated.
    #[error(transparent)]
    Plant(#[from] PlantError),
}

/// Draws a truth for a nominal model, with its grip attached if it is to be held. The same seed and options give the same truth.
///
/// Every effect shows: it changes an output of the nominal device under the working force by at least 3 % of that output's range. Whether a refit of
/// other parameters could hide it is not checked.
///
/// # Errors
///
/// [`DrawError`].
pub fn draw(nominal: &Network, seed: u64, options: &DrawOptions) -> Result<Truth, DrawError> {
    check(options)?;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let probe = Probe::new(nominal, options)?;
    let mut truth = Truth { schema: SCHEMA, seed, ..Truth::nothing(nominal) };
    for _ in 0..options.effects {
        let effect = next_effect(nominal, &probe, &truth.effects, options, &mut random)
            .ok_or_else(|| DrawError::NoPlace { device: nominal.nominal.name.clone(), effects: options.effects })?;
        truth.effects.push(effect);
    }
    truth.numbers = mask::numbers(nominal, &truth.effects, options.masked_percent, &mut random);
    truth.hand = hand(nominal, options.grip_percent, &mut random);
    truth.sensors = sensors(nominal, &probe, options, &mut random);
    // Small enough for readers of JSON that have no whole numbers of 64 bits.
    truth.noise_seed = u64::from(random.random::<u32>());
    Ok(truth)
}

fn check(options: &DrawOptions) -> Result<(), DrawError> {
    if options.effects > 3 {
        return Err(DrawError::Option { option: "effects", value: options.effects as f64, expected: "0 to 3" });
    }
    let ranged = [
        ("masked_percent", options.masked_percent, 0.0, 50.0, "a per cent from 0 to 50"),
        ("grip_percent", options.grip_percent, 0.0, 50.0, "a per cent from 0 to 50"),
        ("encoder_share", options.encoder_share, 0.0, 0.1, "a share from 0 to 0.1"),
        ("noise_share", options.noise_share, 0.0, 0.1, "a share from 0 to 0.1"),
        ("working_force_n", options.working_force_n, f64::MIN_POSITIVE, f64::MAX, "a finite force above 0"),
        ("working_motion_m", options.working_motion_m, f64::MIN_POSITIVE, f64::MAX, "a finite length above 0"),
        ("period_s", options.period_s, 1e-6, 1.0, "a time from 1e-6 to 1 s"),
    ];
    match ranged.into_iter().find(|(_, value, low, high, _)| !(low..=high).contains(&value)) {
        Some((option, value, _, _, expected)) => Err(DrawError::Option { option, value, expected }),
        None => Ok(()),
    }
}

fn next_effect(nominal: &Network, probe: &Probe, chosen: &[Effect], options: &DrawOptions, random: &mut ChaCha8Rng) -> Option<Effect> {
    let mut candidates = candidates::all(nominal);
    candidates.retain(|candidate| !(options.nonlinear_only && candidate.what.is_linear()) && candidate.goes_with(chosen));
    for _ in 0..TRIES_OF_PLACE {
        // Every kind is equally likely, then every place of it.
        let mut kinds: Vec<_> = candidates.iter().map(|candidate| candidate.what).collect();
        kinds.dedup();
        if kinds.is_empty() {
            return None;
        }
        let kind = kinds[random.random_range(0..kinds.len())];
        let places: Vec<&Candidate> = candidates.iter().filter(|candidate| candidate.what == kind).collect();
        let candidate = places[random.random_range(0..places.len())].clone();
        for _ in 0..TRIES_OF_SIZE {
            let Some(physics) = sizes::physics(&candidate, nominal, probe, options, random) else { break };
            let effect = Effect::new(physics, candidate.site.clone(), candidate.replaces.clone(), nominal);
            if probe.shows(nominal, &effect) {
                return Some(effect);
            }
        }
        candidates.retain(|other| *other != candidate);
    }
    None
}

fn hand(nominal: &Network, percent: f64, random: &mut ChaCha8Rng) -> Hand {
    if !nominal.elements.iter().any(|element| element.of_grip) {
        return Hand { stiffness: 1.0, damping: 1.0 };
    }
    let mut factor = || rounded(1.0 + 0.01 * percent * random.random_range(-1.0..=1.0));
    Hand { stiffness: factor(), damping: factor() }
}

fn sensors(nominal: &Network, probe: &Probe, options: &DrawOptions, random: &mut ChaCha8Rng) -> Vec<Sensor> {
    let sensor = |(index, output): (usize, &crate::network::Output)| {
        let range = probe.output_range(index);
        let (step, noise) = (random.random_range(0.3..=1.0), random.random_range(0.3..=1.0));
        let resolution = if options.encoder_share > 0.0 { rounded(step * options.encoder_share * range) } else { output.resolution };
        Sensor { output: output.name.clone(), resolution, noise: rounded(noise * options.noise_share * range) }
    };
    nominal.outputs.iter().enumerate().map(sensor).collect()
}
