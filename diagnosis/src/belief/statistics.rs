//! Statistics of residuals: correlation time, whiteness, root mean square of each output, and model-order selection with correlated residuals.

use crate::output_error::evaluator::Evaluator;
use crate::tuning::tuning;
use backdrive_signal::statistics::middle;

/// Correlation time of residuals in samples, at least 1: so many residuals count as one independent sample. The autocorrelation is summed up to the
/// first lag at which it does not exceed that of white noise; the mean over outputs and recordings is weighted by their cost.
pub fn correlation_time(evaluator: &Evaluator, residuals: &[f64]) -> f64 {
    let (mut total, mut weight) = (0.0, 0.0);
    for (_, _, range) in evaluator.layout() {
        let Some(part) = residuals.get(range) else { continue };
        let energy: f64 = part.iter().map(|x| x * x).sum();
        if energy <= 0.0 {
            continue;
        }
        total += energy * correlation_time_of(part, energy);
        weight += energy;
    }
    if weight > 0.0 { (total / weight).max(1.0) } else { 1.0 }
}

fn correlation_time_of(part: &[f64], energy: f64) -> f64 {
    let longest = part.len() / 4;
    let noise = 2.0 / (part.len() as f64).sqrt();
    let (mut sum, mut lag) = (0.0, 1);
    while lag < longest {
        let product: f64 = part[lag..].iter().zip(part).map(|(a, b)| a * b).sum();
        let correlation = product / energy;
        if correlation < noise {
            break;
        }
        // At long lags only every stride-th one is computed: the sum changes little.
        let stride = (lag / 16).max(1);
        sum += correlation * stride as f64;
        lag += stride;
    }
    1.0 + 2.0 * sum
}

/// Whiteness statistic of residuals: by how many standard deviations the variance of block means exceeds that of white noise. A slow residual of
/// small amplitude shows there long before it correlates neighbouring samples. The largest over the block lengths, 4 to 256 samples; 0 where all
/// recordings are too short for blocks.
pub fn whiteness_statistic(evaluator: &Evaluator, residuals: &[f64]) -> f64 {
    let layout = evaluator.layout();
    let parts: Vec<&[f64]> = layout.iter().filter_map(|(_, _, range)| residuals.get(range.clone())).collect();
    tuning().noise.blocks.into_iter().map(|length| block_statistic(&parts, length)).fold(0.0, f64::max)
}

/// The same for one block length, samples.
fn block_statistic(parts: &[&[f64]], length: usize) -> f64 {
    let (mut surplus, mut variance) = (0.0, 0.0);
    for part in parts {
        let blocks = part.len() / length;
        let power = part.iter().map(|x| x * x).sum::<f64>() / part.len().max(1) as f64;
        if blocks < tuning().noise.fewest_blocks || power <= 0.0 {
            continue;
        }
        let sums = part.chunks_exact(length).map(|block| block.iter().sum::<f64>().powi(2) / (length as f64 * power));
        surplus += sums.map(|s| s - 1.0).sum::<f64>();
        variance += 2.0 * blocks as f64;
    }
    if variance > 0.0 { surplus / variance.sqrt() } else { 0.0 }
}

/// Standard deviation of white noise whose sizes have this median (1/0.6745 of it): a few that are far off do not count. `sizes` is reordered; 0 for none.
pub fn deviation_by_median(sizes: &mut [f64]) -> f64 {
    middle(sizes).map_or(0.0, |middle| 1.4826 * middle)
}

/// Root mean square of the residuals of each output, in noise standard deviations; 0 where it was not measured.
pub fn levels(evaluator: &Evaluator, residuals: &[f64]) -> Vec<f64> {
    let outputs = evaluator.problem.model.outputs.len();
    let (mut sums, mut counts) = (vec![0.0; outputs], vec![0usize; outputs]);
    for (_, output, range) in evaluator.layout() {
        if let Some(part) = residuals.get(range) {
            sums[output] += part.iter().map(|x| x * x).sum::<f64>();
            counts[output] += part.len();
        }
    }
    sums.iter().zip(&counts).map(|(s, n)| if *n > 0 { (s / *n as f64).sqrt() } else { 0.0 }).collect()
}

/// Model-order selection: difference of the Bayesian information criteria of two fits, with the number of independent samples. Positive where the lower
/// cost of the second is worth its additional parameters.
pub fn advantage(cost: f64, numbers: usize, better_cost: f64, better_numbers: usize, samples: usize, correlation_time: f64) -> f64 {
    let effective = (samples as f64 / correlation_time).max(2.0);
    effective * (cost / better_cost).ln() - (better_numbers as f64 - numbers as f64) * effective.ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn a_first_order_process_has_the_correlation_time_of_its_formula() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        for a in [0.0, 0.5, 0.9] {
            let mut x = 0.0;
            let y: Vec<f64> = (0..40_000)
                .map(|_| {
                    let e: f64 = StandardNormal.sample(&mut random);
                    x = a * x + e;
                    x
                })
                .collect();
            let found = correlation_time_of(&y, y.iter().map(|x| x * x).sum());
            let exact = (1.0 + a) / (1.0 - a);
            assert!((found / exact - 1.0).abs() < 0.15, "{a}: {found} {exact}");
        }
    }

    #[test]
    fn a_slow_residual_of_small_amplitude_is_not_white() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let mut noise = |_: usize| -> f64 { StandardNormal.sample(&mut random) };
        let white: Vec<f64> = (0..20_000).map(&mut noise).collect();
        assert!(block_statistic(&[&white], 64).abs() < 4.0);
        // A slow wave of a hundredth of the power: neighbours correlate by 0.01 only, blocks of 64 by much more.
        let waving: Vec<f64> =
            white.iter().enumerate().map(|(i, e)| e + 0.141 * (i as f64 * std::f64::consts::TAU / 1000.0).sin()).collect();
        let energy = waving.iter().map(|x| x * x).sum();
        assert!(correlation_time_of(&waving, energy) < 1.1);
        assert!(block_statistic(&[&waving], 64) > 4.0, "{}", block_statistic(&[&waving], 64));
        // Differences of noise are not slow.
        let differences: Vec<f64> = white.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(block_statistic(&[&differences], 64) < 0.0);
        // Too short for blocks.
        assert_eq!(block_statistic(&[&white[..500]], 64), 0.0);
    }

    #[test]
    fn an_advantage_needs_more_than_chance() {
        assert!(advantage(1000.0, 3, 999.0, 4, 1000, 1.0) < 0.0);
        assert!(advantage(1000.0, 3, 950.0, 4, 1000, 1.0) > 0.0);
        assert!(advantage(1000.0, 3, 950.0, 4, 1000, 20.0) < 0.0);
    }
}
