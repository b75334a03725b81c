//! A velocity beside the derivative of its position: factor and lag, with what they have to be beyond to contradict.

use crate::recordings::follow::{Follow, Profile};
use backdrive_signal::derivative;
use backdrive_signal::low_pass::LowPass;

/// Highest corner of the filter, Hz: what joints of arms do is below it, what encoders and converters add is mostly above.
const CORNER_HZ: f64 = 8.0;
/// The corner lies at this share of the rate at most.
const OF_RATE: f64 = 0.12;
/// Rate to which filtered signals are thinned, Hz; a lag is found between its samples.
const THINNED_HZ: f64 = 200.0;
/// Lags that are tried, s.
const LAGS_S: f64 = 0.25;
/// From this share of the variance on a velocity is that of the position.
pub const EXPLAINED: f64 = 0.8;
/// A factor off by more than this is a unit or a scale; filters and noise make less.
const FACTOR: f64 = 0.12;
/// A lag of a drive's own filter is up to some ms; from here on it spoils damping and friction (at 5 Hz, 12 ms turn 20 degrees).
const LAG_S: f64 = 0.012;
const LAG_SAMPLES: f64 = 1.2;

/// A way to filter and thin signals alike, so that they can be compared.
pub struct Band {
    filter: LowPass,
    stride: usize,
    /// Step of the thinned signals, s.
    pub period: f64,
    full: f64,
}

impl Band {
    /// For signals of this sample time, s, and usual rate, Hz.
    pub fn of(period: f64, rate: f64) -> Band {
        Band::up_to(CORNER_HZ, period, rate)
    }

    /// With another corner, Hz.
    pub fn up_to(corner: f64, period: f64, rate: f64) -> Band {
        let stride = ((rate / THINNED_HZ) as usize).max(1);
        let filter = LowPass::butterworth(2, corner.min(OF_RATE * rate), rate);
        Band { filter, stride, period: period * stride as f64, full: period }
    }

    /// A signal low-passed, without delay, and thinned.
    pub fn smooth(&self, values: &[f64]) -> Vec<f64> {
        self.thinned(&self.filter.both_ways(values))
    }

    /// Its derivative, low-passed and thinned alike.
    pub fn rate(&self, values: &[f64]) -> Vec<f64> {
        self.thinned(&self.filter.both_ways(&derivative(values, self.full)))
    }

    /// Samples of a time.
    pub fn samples(&self, seconds: f64) -> i64 {
        (seconds / self.period).round() as i64
    }

    fn thinned(&self, values: &[f64]) -> Vec<f64> {
        values.iter().step_by(self.stride).copied().collect()
    }
}

/// How a velocity follows the derivative of its position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kinematics {
    /// Its size as a multiple of the derivative; negative where the sign is turned round.
    pub gain: f64,
    /// Share of its variance that the derivative explains, 0 to 1.
    pub explained: f64,
    /// How much later than the derivative it is, s; negative where it is earlier.
    pub lag_s: f64,
    /// Half-width of the 95 % interval of that, s; infinite where it cannot be determined.
    pub half_s: f64,
    /// Sample time of the recording, s.
    pub period: f64,
}

impl Kinematics {
    /// Of even samples of a position and a velocity; `None` where one of them does not move.
    pub fn of(position: &[f64], velocity: &[f64], band: &Band) -> Option<Kinematics> {
        let (rate, told) = (band.rate(position), band.smooth(velocity));
        let profile = Profile::new(&rate, &told, (-band.samples(LAGS_S), band.samples(LAGS_S)), None);
        let Follow { lag, gain, explained, .. } = profile.best(None)?;
        let half_s = profile.uncertainty().map_or(f64::INFINITY, |half| half * band.period);
        Some(Kinematics { gain, explained, lag_s: lag * band.period, half_s, period: band.full })
    }

    /// Whether the velocity is that of the position at all.
    pub fn is_explained(&self) -> bool {
        self.explained >= EXPLAINED
    }

    /// Whether its size is another than the derivative's, by a scale or a unit.
    pub fn is_scaled(&self) -> bool {
        (self.gain.abs() - 1.0).abs() > FACTOR
    }

    /// Whether it is late or early by more than a drive's own filter makes it, beyond its interval.
    pub fn is_shifted(&self) -> bool {
        self.lag_s.abs() > LAG_S.max(LAG_SAMPLES * self.period) && self.lag_s.abs() - self.half_s > 0.5 * self.period
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factor_and_lag_of_a_velocity_are_found_beside_its_position() {
        let t: Vec<f64> = (0..4000).map(|i| f64::from(i) * 2e-3).collect();
        let speed = |t: f64| 2.0 * (2.0 * t).cos() + 1.5 * (5.3 * t).cos();
        let position: Vec<f64> = t.iter().map(|t| (2.0 * t).sin() + 1.5 / 5.3 * (5.3 * t).sin()).collect();
        let of = |gain: f64, early: f64| {
            let velocity: Vec<f64> = t.iter().map(|t| gain * speed(t + early)).collect();
            Kinematics::of(&position, &velocity, &Band::of(2e-3, 500.0)).unwrap()
        };
        let right = of(1.0, 0.003);
        assert!(right.is_explained() && !right.is_scaled() && !right.is_shifted(), "{right:?}");
        let wrong = of(-3.26, 0.039);
        assert!((wrong.gain + 3.26).abs() < 0.02 && (wrong.lag_s + 0.039).abs() < 1e-3, "{wrong:?}");
        assert!(wrong.is_scaled() && wrong.is_shifted());
        assert!(Kinematics::of(&position, &vec![0.0; 4000], &Band::of(2e-3, 500.0)).is_none());
    }
}
