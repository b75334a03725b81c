//! Zero-phase Butterworth filters, as `filtfilt` of signal processing tools: forward and backward, so that nothing is delayed.

use sci_rs::signal::filter::design::{DigitalFilter, FilterBandType, FilterOutputType, Sos, butter_dyn};
use sci_rs::signal::filter::sosfiltfilt_dyn;

/// A low-pass of some order and corner, run over the samples in both directions: the response counts twice, the corner has half the amplitude.
#[derive(Debug, Clone)]
pub struct LowPass {
    sections: Vec<Sos<f64>>,
}

impl LowPass {
    /// A Butterworth low-pass: its order, its corner in Hz, the sample rate in Hz. The corner has to lie below half the rate; from there on
    /// samples pass as they are.
    pub fn butterworth(order: usize, corner: f64, rate: f64) -> LowPass {
        if !(corner > 0.0 && corner < 0.5 * rate && order > 0) {
            return LowPass { sections: Vec::new() };
        }
        let design = butter_dyn(order, vec![corner], Some(FilterBandType::Lowpass), Some(false), Some(FilterOutputType::Sos), Some(rate));
        match design {
            DigitalFilter::Sos(filter) => LowPass { sections: filter.sos },
            _ => LowPass { sections: Vec::new() },
        }
    }

    /// The samples filtered forward and backward.
    pub fn both_ways(&self, samples: &[f64]) -> Vec<f64> {
        // The filter begins and ends on a mirrored piece of the signal; what is shorter has none.
        if self.sections.is_empty() || samples.len() < 10 * self.sections.len() {
            return samples.to_vec();
        }
        sosfiltfilt_dyn(samples.iter(), &self.sections)
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

/// First derivative by central differences, one-sided at both ends.
pub fn derivative(samples: &[f64], period: f64) -> Vec<f64> {
    let last = samples.len().saturating_sub(1);
    let at = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
        if a == b { 0.0 } else { (samples[b] - samples[a]) / ((b - a) as f64 * period) }
    };
    (0..samples.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Product of polynomials in the delay.
    fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; a.len() + b.len() - 1];
        for (i, x) in a.iter().enumerate() {
            for (j, y) in b.iter().enumerate() {
                out[i + j] += x * y;
            }
        }
        out
    }

    #[test]
    fn the_fourth_order_at_a_fifth_of_half_the_rate_has_the_coefficients_of_the_tables() {
        // Butterworth, order 4, corner 0.2 of half the rate; by the bilinear transform of the analogue poles.
        let b = [0.004824343357716228, 0.019297373430864913, 0.02894606014629737, 0.019297373430864913, 0.004824343357716228];
        let a = [1.0, -2.3695130071820376, 2.31398841441588, -1.0546654058785676, 0.18737949236818494];
        let filter = LowPass::butterworth(4, 100.0, 1000.0);
        let (mut num, mut den) = (vec![1.0], vec![1.0]);
        for s in &filter.sections {
            num = product(&num, &s.b);
            den = product(&den, &s.a);
        }
        for (found, exact) in num.iter().zip(b).chain(den.iter().zip(a)) {
            assert!((found - exact).abs() < 1e-12, "{found} {exact}");
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

    #[test]
    fn central_differences_are_exact_on_a_parabola() {
        let samples: Vec<f64> = (0..20).map(|i| f64::from(i * i)).collect();
        let d = derivative(&samples, 0.5);
        assert!((1..19).all(|i| (d[i] - 4.0 * i as f64).abs() < 1e-12));
        assert!(derivative(&[], 1.0).is_empty() && derivative(&[3.0], 1.0) == [0.0]);
    }
}
