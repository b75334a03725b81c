//! Which hand of a bank moves as the master does.

use super::filter::Steep;

/// Below this the hand moves on its own accord, Hz: what it wants is measured by nobody.
const INTENT_HZ: f64 = 10.0;
/// Error of a model that is right, as a share of the motion: errors of a model grow with what it predicts.
const MODEL_ERROR: f64 = 0.03;
/// What a position sensor leaves at least, m or rad.
const LEAST_NOISE: f64 = 1e-6;
/// Over which time the motion's power is taken, s.
const POWER_S: f64 = 0.01;
/// Errors of a model are alike over this time, s: so many samples count as one.
const ALIKE_S: f64 = 0.01;
/// How long a memory is, s: the short one sees a change soon, the long one is sure.
const MEMORIES_S: [f64; 2] = [0.03, 0.5];
/// The long memory is given up for the short one where they differ by so many standard deviations.
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
    pairs: Vec<Pair>,
}

impl Memory {
    fn new(time_s: f64, period_s: f64, pairs: usize) -> Memory {
        Memory { keep: (-period_s / time_s).exp(), samples: 0.0, pairs: vec![Pair::default(); pairs] }
    }

    fn hear(&mut self, errors: &[f64], weight: f64) {
        self.samples = self.keep * self.samples + 1.0;
        for (pair, two) in self.pairs.iter_mut().zip(errors.windows(2)) {
            pair.first = self.keep * pair.first + weight * two[0] * two[0];
            pair.both = self.keep * pair.both + weight * two[0] * two[1];
            pair.second = self.keep * pair.second + weight * two[1] * two[1];
        }
    }

    /// The softness whose error is least, the motion between neighbours being linear in it.
    fn estimate(&self, softness: &[f64], alike: f64) -> Estimate {
        let mut best = (f64::INFINITY, Estimate { softness: softness[0], deviation: f64::INFINITY });
        for (pair, hands) in self.pairs.iter().zip(softness.windows(2)) {
            let curvature = pair.first - 2.0 * pair.both + pair.second;
            let share = if curvature > 0.0 { ((pair.first - pair.both) / curvature).clamp(0.0, 1.0) } else { 0.0 };
            let error = pair.first - 2.0 * share * (pair.first - pair.both) + share * share * curvature;
            if error < best.0 {
                let misfit = (error / self.samples.max(1.0)).max(1.0);
                let deviation = (hands[1] - hands[0]) * (misfit * alike / curvature).sqrt();
                best = (error, Estimate { softness: hands[0] + share * (hands[1] - hands[0]), deviation });
            }
        }
        best.1
    }
}

/// Estimates one axis' hand from its measured position and what a bank predicts of it.
#[derive(Debug, Clone)]
pub struct HandEstimator {
    softness: Vec<f64>,
    measured: Steep,
    predicted: Vec<Steep>,
    errors: Vec<f64>,
    power: f64,
    power_keep: f64,
    noise: f64,
    alike: f64,
    short: Memory,
    long: Memory,
}

impl HandEstimator {
    /// For hands of these softnesses, ascending. `noise` is the standard deviation of the position sensor, m or rad.
    pub fn new(softness: &[f64], noise: f64, period_s: f64) -> HandEstimator {
        let pairs = softness.len().saturating_sub(1);
        let memory = |time_s: f64| Memory::new(time_s, period_s, pairs);
        let [short, long] = MEMORIES_S.map(memory);
        HandEstimator {
            softness: softness.to_vec(),
            measured: Steep::new(INTENT_HZ, period_s),
            predicted: vec![Steep::new(INTENT_HZ, period_s); softness.len()],
            errors: vec![0.0; softness.len()],
            power: 0.0,
            power_keep: (-period_s / POWER_S).exp(),
            noise: noise.max(LEAST_NOISE),
            alike: (ALIKE_S / period_s).max(1.0),
            short,
            long,
        }
    }

    /// Hears a sample: the measured position and the bank's, all at this step. Whether the hand was seen to have changed.
    pub fn step(&mut self, measured: f64, predicted: impl Fn(usize) -> f64) -> bool {
        let seen = self.measured.step(measured);
        let mut largest = 0.0_f64;
        for (hand, (filter, error)) in self.predicted.iter_mut().zip(&mut self.errors).enumerate() {
            let predicted = filter.step(predicted(hand));
            largest = largest.max(predicted * predicted);
            *error = seen - predicted;
        }
        self.power = self.power_keep * self.power + (1.0 - self.power_keep) * seen * seen;
        let weight = 1.0 / (self.noise * self.noise + MODEL_ERROR * MODEL_ERROR * self.power);
        self.short.hear(&self.errors, weight);
        self.long.hear(&self.errors, weight);
        let (now, before) = (self.short.estimate(&self.softness, self.alike), self.long.estimate(&self.softness, self.alike));
        let changed = (now.softness - before.softness).abs() > CHANGED * now.deviation.hypot(before.deviation);
        if changed {
            self.long.samples = self.short.samples;
            self.long.pairs.copy_from_slice(&self.short.pairs);
        }
        changed
    }

    /// What is known now.
    pub fn estimate(&self) -> Estimate {
        self.long.estimate(&self.softness, self.alike)
    }
}
