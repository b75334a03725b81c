//! What is computed of any sampled signal: the power spectral density.

/// Power spectral density of samples `period` s apart, by Welch's method (Hann windows, half overlapping, about 16 of them): frequencies,
/// Hz, and density in the unit squared per Hz. White noise of standard deviation s has the density 2 s² period. Empty for fewer than 32
/// samples.
pub fn density(samples: &[f64], period: f64) -> (Vec<f64>, Vec<f64>) {
    let size = (samples.len() / 8).max(32);
    if samples.len() < size || size < 32 {
        return Default::default();
    }
    let window: Vec<f64> = (0..size).map(|i| (std::f64::consts::PI * (i as f64 + 0.5) / size as f64).sin().powi(2)).collect();
    let scale = 2.0 * period / window.iter().map(|w| w * w).sum::<f64>();
    let mut planner = realfft::RealFftPlanner::<f64>::new();
    let transform = planner.plan_fft_forward(size);
    let (mut output, mut sums, mut count) = (transform.make_output_vec(), vec![0.0; size / 2 + 1], 0.0);
    let mut from = 0;
    while from + size <= samples.len() {
        let part = &samples[from..from + size];
        let mean = part.iter().sum::<f64>() / size as f64;
        let mut input: Vec<f64> = part.iter().zip(&window).map(|(x, w)| (x - mean) * w).collect();
        if transform.process(&mut input, &mut output).is_err() {
            return Default::default();
        }
        sums.iter_mut().zip(&output).for_each(|(s, c)| *s += c.norm_sqr() * scale);
        count += 1.0;
        from += (size / 2).max(1);
    }
    // The mean was taken off: its line carries no information.
    (1..sums.len()).map(|k| (k as f64 / (size as f64 * period), sums[k] / count)).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn white_noise_has_its_density() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let noise: Vec<f64> =
            (0..20_000).map(|_| 0.3 * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut random)).collect();
        let (hz, density) = density(&noise, 1e-3);
        let mean = density.iter().sum::<f64>() / density.len() as f64;
        assert!((mean / (2.0 * 0.09 * 1e-3) - 1.0).abs() < 0.05, "{mean}");
        assert!((hz[hz.len() - 1] - 500.0).abs() < 1.0);
        assert!(super::density(&noise[..20], 1e-3).0.is_empty());
    }
}
