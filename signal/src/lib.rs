//! What is computed of any samples, whatever they measure: [`statistics`], [`derivative`]s, and Butterworth low-passes.
//!
//! A [`butterworth::Butterworth`] takes sample by sample and delays; a [`low_pass::LowPass`] has the whole signal and does not delay.

pub mod butterworth;
pub mod low_pass;
pub mod statistics;

/// Rate of change of samples `period` apart: central differences, one-sided at both ends.
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
    use super::derivative;

    #[test]
    fn central_differences_are_exact_on_a_parabola() {
        let samples: Vec<f64> = (0..20).map(|i| f64::from(i * i)).collect();
        let d = derivative(&samples, 0.5);
        assert!((1..19).all(|i| (d[i] - 4.0 * i as f64).abs() < 1e-12));
        assert!(derivative(&[], 1.0).is_empty() && derivative(&[3.0], 1.0) == [0.0]);
    }
}
