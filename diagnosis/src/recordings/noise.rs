//! Noise standard deviation of a measured signal, from its differences of rising order.

use crate::recordings::problem::Record;
use crate::tuning::tuning;
use backdrive_plant::model::Model;
use backdrive_signal::statistics::middle;

/// Standard deviation of the white part of a signal, in its unit. It is the smallest of the medians over blocks, over differences of rising order, each
/// scaled so that white noise keeps its size. `None` for fewer than 40 samples.
pub fn white(samples: &[f64]) -> Option<f64> {
    blocks_of(samples).map(|blocks| median_of_orders(&[blocks]))
}

/// For each order of difference, the mean square in each block.
fn blocks_of(samples: &[f64]) -> Option<Vec<Vec<f64>>> {
    if samples.len() < 40 {
        return None;
    }
    let mut difference = samples.to_vec();
    let mut gain = 1.0;
    let mut all = Vec::new();
    for order in 1..=tuning().recordings.noise_orders {
        for i in 0..difference.len() - 1 {
            difference[i] = difference[i + 1] - difference[i];
        }
        difference.pop();
        // The squares of binomial coefficients add up to C(2 order, order).
        gain *= 2.0 * (2 * order - 1) as f64 / order as f64;
        let size = (difference.len() / tuning().recordings.noise_blocks).max(16);
        all.push(difference.chunks_exact(size).map(|b| b.iter().map(|x| x * x).sum::<f64>() / (gain * size as f64)).collect());
    }
    Some(all)
}

fn median_of_orders(signals: &[Vec<Vec<f64>>]) -> f64 {
    let of_order = |order: usize| {
        let mut all: Vec<f64> = signals.iter().filter_map(|s| s.get(order)).flatten().copied().collect();
        median(&mut all)
    };
    (0..tuning().recordings.noise_orders).map(of_order).fold(f64::INFINITY, f64::min).sqrt()
}

fn median(values: &mut [f64]) -> f64 {
    middle(values).unwrap_or(f64::INFINITY)
}

/// Noise standard deviation of an output over all recordings of it, in its unit: its white part, and at least the error of rounding.
pub fn of_signal(model: &Model, records: &[Record], output: usize) -> f64 {
    let signals: Vec<&[f64]> = records.iter().filter_map(|r| r.compared(output)).collect();
    let spread = records.iter().filter_map(|r| r.spread.get(output)).fold(0.0f64, |a, b| a.max(*b));
    of(&signals, stated(model, output, &signals), spread)
}

/// The same of the residuals of a fit, which hold fewer steps than the signal; `least` is that of rounding, `spread` the standard deviation of the
/// signal.
pub fn of_residuals(residuals: &[&[f64]], least: f64, spread: f64) -> f64 {
    of(residuals, least, spread)
}

fn of(signals: &[&[f64]], least: f64, spread: f64) -> f64 {
    let blocks: Vec<_> = signals.iter().filter_map(|s| blocks_of(s)).collect();
    let white = median_of_orders(&blocks);
    // Residuals are divided by it, so it is never 0: at least a millionth of the signal.
    let white = if white.is_finite() { white } else { 0.0 };
    white.max(least).max(tuning().recordings.least_noise * spread)
}

/// Noise standard deviation that the model file states for an output, with that of rounding to its resolution q, q/√12. Where the file states no
/// resolution, the step of the samples is taken.
pub fn stated(model: &Model, output: usize, signals: &[&[f64]]) -> f64 {
    let Some(o) = model.outputs.get(output) else { return 0.0 };
    let step = if o.resolution > 0.0 { o.resolution } else { signals.iter().find_map(|s| step_of(s)).unwrap_or(0.0) };
    (step * step / 12.0 + o.noise * o.noise).sqrt()
}

/// The step of a rounded signal: every sample is a multiple of it, and it is the smallest difference. `None` where there is none.
pub fn step_of(samples: &[f64]) -> Option<f64> {
    let largest = samples.iter().fold(0.0f64, |a, x| a.max(x.abs()));
    let step = samples.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 1e-6 * largest).fold(f64::INFINITY, f64::min);
    if !step.is_finite() || samples.len() < 100 {
        return None;
    }
    let off = |d: f64| ((d / step) - (d / step).round()).abs();
    // Files hold seven digits: far from 0 that blurs the step.
    let fits = samples.windows(2).filter(|w| off(w[1] - w[0]) < 0.02 + 2e-6 * largest / step).count();
    let same = samples.windows(2).filter(|w| (w[1] - w[0]).abs() < 0.5 * step).count();
    (fits as f64 > 0.98 * (samples.len() - 1) as f64 && 2e-6 * largest / step < 0.1 && same > 0).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn noise(n: usize, sd: f64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        (0..n).map(|_| sd * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut random)).collect()
    }

    #[test]
    fn white_noise_on_a_smooth_signal_is_measured() {
        let y: Vec<f64> = noise(8000, 0.01).iter().enumerate().map(|(i, e)| (i as f64 * 0.02).sin() + e).collect();
        let found = white(&y).unwrap();
        assert!((found - 0.01).abs() < 0.001, "{found}");
    }

    #[test]
    fn a_few_jumps_do_not_count() {
        let y: Vec<f64> = noise(8000, 0.01).iter().enumerate().map(|(i, e)| if (i / 1000) % 2 == 0 { 1.0 } else { -1.0 } + e).collect();
        let found = white(&y).unwrap();
        assert!((found - 0.01).abs() < 0.001, "{found}");
    }

    #[test]
    fn the_step_of_an_encoder_is_found() {
        let y: Vec<f64> = (0..2000).map(|i| 0.004 * (f64::from(i) * 0.01).sin()).map(|x| 3.8e-6 * (x / 3.8e-6).round()).collect();
        let found = step_of(&y).unwrap();
        assert!((found / 3.8e-6 - 1.0).abs() < 1e-6, "{found}");
        assert_eq!(step_of(&noise(2000, 1.0)), None);
    }
}
