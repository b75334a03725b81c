//! Zero-phase Butterworth filters, as `filtfilt` of signal processing tools: forward and backward, so that nothing is delayed.

use crate::butterworth::{Butterworth, both_ways};

/// A low-pass of some order and corner, run over the samples in both directions: the response counts twice, the corner has half the amplitude.
#[derive(Debug, Clone)]
pub struct LowPass {
    order: usize,
    filter: Butterworth,
}

impl LowPass {
    /// A Butterworth low-pass: its order, its corner in Hz, the sample rate in Hz. The corner has to lie below half the rate; from there on
    /// samples pass as they are.
    pub fn butterworth(order: usize, corner: f64, rate: f64) -> LowPass {
        let corner = if order > 0 { corner } else { 0.0 };
        LowPass { order, filter: Butterworth::new(order, corner, 1.0 / rate) }
    }

    /// The samples filtered forward and backward. The filter begins and ends on a piece of the signal turned about its end, as `sosfiltfilt` of SciPy.
    /// Samples of which there are too few for that pass unchanged.
    pub fn both_ways(&self, samples: &[f64]) -> Vec<f64> {
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return Vec::new() };
        if self.filter.passes_all() || samples.len() < 10 * self.order.div_ceil(2) {
            return samples.to_vec();
        }
        let edge = 3 * (self.order + 1);
        let before = samples[1..=edge].iter().rev().map(|x| 2.0 * first - x);
        let after = samples.iter().rev().skip(1).take(edge).map(|x| 2.0 * last - x);
        let mut filtered = both_ways(&self.filter, before.chain(samples.iter().copied()).chain(after));
        filtered.truncate(edge + samples.len());
        filtered.drain(..edge);
        filtered
    }

    /// Share of the power of white noise that passes both ways, 0 to 1.
    pub fn share_of_white(&self) -> f64 {
        let mut impulse = vec![0.0; IMPULSE];
        impulse[IMPULSE / 2] = 1.0;
        self.both_ways(&impulse).iter().map(|x| x * x).sum()
    }
}

/// Samples of an impulse response, twice what the lowest corner in use rings for.
const IMPULSE: usize = 16_384;

#[cfg(test)]
mod tests {
    use super::*;

    /// Order, corner, rate and number of samples of `x = sin(0.31 k) + 0.5 cos(1.7 k) + 0.01 k`, and samples 0, 1, 7, the middle one and the
    /// last two of SciPy 1.17.1 `sosfiltfilt(butter(order, corner, fs=rate, output="sos"), x)`.
    const SCIPY: [(usize, f64, f64, usize, [f64; 6]); 6] = [
        (
            1,
            12.0,
            100.0,
            40,
            [0.5007001888405378, 0.46031834208487943, 0.8281873234993388, 0.08231926348302857, -0.45209680243220063, -0.541083652289157],
        ),
        (
            2,
            3.0,
            100.0,
            60,
            [0.460485813245674, 0.44898035358594024, 0.28433443965994676, 0.30634432126639716, 0.5591947765234422, 0.592527238560019],
        ),
        (
            3,
            20.0,
            250.0,
            60,
            [0.494011147355001, 0.6231683683055214, 0.7997551943550208, 0.41893737123484964, 0.21951458328014534, 0.5373955510523366],
        ),
        (
            4,
            100.0,
            1000.0,
            80,
            [0.5037058970621617, 0.6077055797617156, 0.8648448688792175, 0.23488158662010794, -0.19289248131277545, -0.15253511789676333],
        ),
        (
            4,
            2.0,
            1000.0,
            200,
            [1.0610446861292795, 1.059856856295152, 1.052953951276073, 0.9945119840194955, 0.9889786557562171, 0.9889785352651784],
        ),
        (
            6,
            40.0,
            100.0,
            90,
            [0.4992193137401, 0.24106562188349415, 1.2899229407978248, 1.6585369707870568, 1.8934148889619817, 1.9564662825041663],
        ),
    ];

    fn wave(k: usize) -> f64 {
        let k = k as f64;
        (0.31 * k).sin() + 0.5 * (1.7 * k).cos() + 0.01 * k
    }

    #[test]
    fn it_filters_as_scipy_does() {
        for (order, corner, rate, count, expected) in SCIPY {
            let x: Vec<f64> = (0..count).map(wave).collect();
            let y = LowPass::butterworth(order, corner, rate).both_ways(&x);
            assert_eq!(y.len(), count);
            for (k, expected) in [0, 1, 7, count / 2, count - 2, count - 1].into_iter().zip(expected) {
                assert!((y[k] - expected).abs() < 1e-10, "order {order}, sample {k}: {} {expected}", y[k]);
            }
        }
    }

    #[test]
    fn a_wave_keeps_its_phase_and_loses_amplitude_by_the_square_of_the_response() {
        let (rate, corner, frequency) = (1000.0f64, 100.0f64, 60.0f64);
        let wave = |i: usize| (std::f64::consts::TAU * frequency * i as f64 / rate).sin();
        let samples: Vec<f64> = (0..4000).map(wave).collect();
        let filtered = LowPass::butterworth(4, corner, rate).both_ways(&samples);
        let tan = |f: f64| (std::f64::consts::PI * f / rate).tan();
        let gain = 1.0 / (1.0 + (tan(frequency) / tan(corner)).powi(8));
        for i in 500..3500 {
            assert!((filtered[i] - gain * samples[i]).abs() < 1e-6, "{i}: {} {}", filtered[i], gain * samples[i]);
        }
    }

    #[test]
    fn white_noise_passes_with_the_share_of_the_response_s_area() {
        // Area below 1 / (1 + (tan(pi x) / tan(pi c))^8)^2 for c = 0.1, by the midpoint rule.
        let tan = |x: f64| (std::f64::consts::PI * x).tan();
        let steps = 20_000;
        let at = |i: usize| 0.5 * (i as f64 + 0.5) / steps as f64;
        let area: f64 = (0..steps).map(|i| (1.0 + (tan(at(i)) / tan(0.1)).powi(8)).powi(-2)).sum::<f64>() / steps as f64;
        let found = LowPass::butterworth(4, 100.0, 1000.0).share_of_white();
        assert!((found - area).abs() < 1e-6, "{found} {area}");
        assert_eq!(LowPass::butterworth(4, 600.0, 1000.0).share_of_white(), 1.0);
    }

    #[test]
    fn what_cannot_be_filtered_passes_as_it_is() {
        let samples: Vec<f64> = (0..50).map(f64::from).collect();
        assert_eq!(LowPass::butterworth(4, 600.0, 1000.0).both_ways(&samples), samples);
        assert_eq!(LowPass::butterworth(4, 100.0, 1000.0).both_ways(&samples[..5]), samples[..5]);
    }
}
