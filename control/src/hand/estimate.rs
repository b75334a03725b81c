//! Which hand of a bank moves as the master does.

use super::filter::Steep;

/// Corners of the high-passes that filter positions, Hz. The hand also moves by itself, which is not measured, and more at lower frequencies; a loop
/// that runs away is slow as well.
const BANDS_HZ: [f64; 2] = [8.0, 25.0];
/// How the hand moves on its own accord, m/s^3 or rad/s^3: the jerk of a move of 4 mm in 0.15 s or of 10 cm in 0.5 s (Flash & Hogan 1985).
const INTENT_JERK: f64 = 50.0;
/// Memory of the misfit, s: longer than the signals that distinguish the hands, so that an estimate grows uncertain where nothing moves.
const MISFIT_S: f64 = 3.0;
/// Error of a model that is right, as a share of the motion: errors of a model grow with what it predicts.
const MODEL_ERROR: f64 = 0.03;
/// What a position sensor leaves at least, m or rad.
const LEAST_NOISE: f64 = 1e-6;
/// Over which time the motion's power is taken, s.
const POWER_S: f64 = 0.01;
/// Correlation time of the errors of a model, s: the samples within it count as one.
const ALIKE_S: f64 = 0.01;
/// How long a memory is, s: the short one sees a change soon, the long one is sure.
const MEMORIES_S: [f64; 2] = [0.03, 0.5];
/// The short memory replaces the long one where they differ by this number of standard deviations.
const CHANGED: f64 = 3.0;

/// What is known of a hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// 1 over the factor on the grip of the file.
    pub softness: f64,
    /// Its standard deviation; infinite where nothing is known.
    pub deviation: f64,
}

impl Estimate {
    /// Factor on stiffness and damping of the grip of the file.
    pub fn firmness(&self) -> f64 {
        1.0 / self.softness
    }
}

/// Sums over the past of neighbours' errors.
#[derive(Debug, Clone, Copy, Default)]
struct Pair {
    first: f64,
    both: f64,
    second: f64,
}

/// Errors of a bank with forgetting.
#[derive(Debug, Clone)]
struct Memory {
    keep: f64,
    samples: f64,
    /// Misfit for which the errors' scale is forgotten more slowly.
    misfit: f64,
    misfit_keep: f64,
    pairs: Vec<Pair>,
    /// What follows from the sums.
    estimate: Estimate,
}

impl Memory {
    fn new(time_s: f64, period_s: f64, pairs: usize) -> Memory {
        Memory {
            keep: (-period_s / time_s).exp(),
            samples: 0.0,
            misfit: 1.0,
            misfit_keep: (-period_s / MISFIT_S).exp(),
            pairs: vec![Pair::default(); pairs],
            estimate: Estimate { softness: 0.0, deviation: f64::INFINITY },
        }
    }

    fn forget(&mut self) {
        self.samples = self.keep * self.samples + 1.0;
        for pair in &mut self.pairs {
            *pair = Pair { first: self.keep * pair.first, both: self.keep * pair.both, second: self.keep * pair.second };
        }
    }

    fn hear(&mut self, errors: &[f64], weight: f64) {
        for (pair, two) in self.pairs.iter_mut().zip(errors.windows(2)) {
            pair.first += weight * two[0] * two[0];
            pair.both += weight * two[0] * two[1];
            pair.second += weight * two[1] * two[1];
        }
    }

    /// Takes the softness whose error is least, the motion between neighbours being linear in it.
    fn conclude(&mut self, softness: &[f64], alike: f64) {
        let mut best = (f64::INFINITY, 0.0, 0.0);
        for (pair, hands) in self.pairs.iter().zip(softness.windows(2)) {
            let curvature = pair.first - 2.0 * pair.both + pair.second;
            let share = if curvature > 0.0 { ((pair.first - pair.both) / curvature).clamp(0.0, 1.0) } else { 0.0 };
            let error = pair.first - 2.0 * share * (pair.first - pair.both) + share * share * curvature;
            if error < best.0 {
                let width = hands[1] - hands[0];
                best = (error, hands[0] + share * width, curvature / (width * width));
            }
        }
        let (error, softness, curvature) = best;
        let misfit = error / (BANDS_HZ.len() as f64 * self.samples.max(1.0));
        self.misfit = (1.0 + self.misfit_keep * (self.misfit - 1.0)).max(misfit);
        self.estimate = Estimate { softness, deviation: (self.misfit * alike / curvature).sqrt() };
    }
}

/// One band of a position and of the bank's predictions of it.
#[derive(Debug, Clone)]
struct Band {
    measured: Steep,
    predicted: Vec<Steep>,
    /// Variance of what is neither the force's doing nor the model's error, m^2.
    noise: f64,
    power: f64,
    weight: f64,
    errors: Vec<f64>,
}

impl Band {
    fn new(corner_hz: f64, hands: usize, noise: f64, period_s: f64) -> Band {
        let intent = INTENT_JERK / (2.0 * std::f64::consts::PI * corner_hz).powi(3);
        Band {
            measured: Steep::new(corner_hz, period_s),
            predicted: vec![Steep::new(corner_hz, period_s); hands],
            noise: noise * noise + intent * intent,
            power: 0.0,
            weight: 0.0,
            errors: vec![0.0; hands],
        }
    }

    fn step(&mut self, measured: f64, predicted: &impl Fn(usize) -> f64, power_keep: f64) {
        let seen = self.measured.step(measured);
        for (hand, (filter, error)) in self.predicted.iter_mut().zip(&mut self.errors).enumerate() {
            *error = seen - filter.step(predicted(hand));
        }
        self.power = power_keep * self.power + (1.0 - power_keep) * seen * seen;
        self.weight = 1.0 / (self.noise + MODEL_ERROR * MODEL_ERROR * self.power);
    }
}

/// Estimates one axis' hand from its measured position and what a bank predicts of it.
#[derive(Debug, Clone)]
pub struct HandEstimator {
    softness: Vec<f64>,
    bands: [Band; BANDS_HZ.len()],
    power_keep: f64,
    alike: f64,
    short: Memory,
    long: Memory,
}

impl HandEstimator {
    /// For hands of these softnesses, ascending. `noise` is the standard deviation of the position sensor, m or rad.
    pub fn new(softness: &[f64], noise: f64, period_s: f64) -> HandEstimator {
        let hands = softness.len();
        let [short, long] = MEMORIES_S.map(|time_s| Memory::new(time_s, period_s, hands.saturating_sub(1)));
        HandEstimator {
            softness: softness.to_vec(),
            bands: BANDS_HZ.map(|corner_hz| Band::new(corner_hz, hands, noise.max(LEAST_NOISE), period_s)),
            power_keep: (-period_s / POWER_S).exp(),
            alike: (ALIKE_S / period_s).max(1.0),
            short,
            long,
        }
    }

    /// Hears a sample: the measured position and the bank's, all at this step. Whether the hand was seen to have changed.
    pub fn step(&mut self, measured: f64, predicted: impl Fn(usize) -> f64) -> bool {
        for band in &mut self.bands {
            band.step(measured, &predicted, self.power_keep);
        }
        for memory in [&mut self.short, &mut self.long] {
            memory.forget();
            self.bands.iter().for_each(|band| memory.hear(&band.errors, band.weight));
            memory.conclude(&self.softness, self.alike);
        }
        let (now, before) = (self.short.estimate, self.long.estimate);
        let changed = (now.softness - before.softness).abs() > CHANGED * now.deviation.hypot(before.deviation);
        if changed {
            self.long.samples = self.short.samples;
            self.long.misfit = self.short.misfit;
            self.long.pairs.copy_from_slice(&self.short.pairs);
            self.long.estimate = now;
        }
        changed
    }

    /// What is known now. A deviation of the short memory beyond its own uncertainty counts as uncertainty of the long one: the hand may be changing.
    pub fn estimate(&self) -> Estimate {
        let (now, before) = (self.short.estimate, self.long.estimate);
        let apart = (now.softness - before.softness).powi(2) - now.deviation.powi(2);
        // Where the short memory knows nothing, `apart` is no number above 0.
        let deviation = if apart > 0.0 { before.deviation.hypot(apart.sqrt()) } else { before.deviation };
        Estimate { deviation, ..before }
    }
}
