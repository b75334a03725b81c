//! Statistics of plain slices: quantiles, ranges, runs.

use backdrive_diagnosis::belief::statistics::deviation_by_median;
pub use backdrive_signal::statistics::{deviation, mean};

/// The value below which this share of the finite values lies; 0 of none.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut finite: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    if finite.is_empty() {
        return 0.0;
    }
    let place = ((finite.len() - 1) as f64 * share.clamp(0.0, 1.0)).round() as usize;
    *finite.select_nth_unstable_by(place, f64::total_cmp).1
}

/// Median of the finite values.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// Smallest and largest finite value; `None` of none.
pub fn extremes(values: &[f64]) -> Option<(f64, f64)> {
    let found =
        values.iter().filter(|x| x.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
    (found.0 <= found.1).then_some(found)
}

/// Width of the range in which 99 % of the values lie.
pub fn width(values: &[f64]) -> f64 {
    quantile(values, 0.995) - quantile(values, 0.005)
}

/// Difference of the largest and the smallest value.
pub fn span(values: &[f64]) -> f64 {
    extremes(values).map_or(0.0, |(low, high)| high - low)
}

/// Standard deviation of the steps of a clock, s, in ms; what is below a nanosecond is rounding.
pub fn jitter_ms(steps: &[f64]) -> f64 {
    let jitter = 1e3 * deviation(steps);
    if jitter < 1e-6 { 0.0 } else { jitter }
}

/// Standard deviation by the median of the distances from the median.
pub fn robust_deviation(values: &[f64]) -> f64 {
    let middle = median(values);
    let mut sizes: Vec<f64> = values.iter().filter(|x| x.is_finite()).map(|x| (x - middle).abs()).collect();
    deviation_by_median(&mut sizes)
}

/// Every `stride`-th value.
pub fn thinned(values: &[f64], stride: usize) -> Vec<f64> {
    values.iter().step_by(stride.max(1)).copied().collect()
}

/// Correlation of neighbours, -1 to 1; 0 of a constant.
pub fn neighbour_correlation(values: &[f64]) -> f64 {
    let middle = mean(values);
    let power: f64 = values.iter().map(|x| (x - middle).powi(2)).sum();
    let product: f64 = values.windows(2).map(|w| (w[0] - middle) * (w[1] - middle)).sum();
    if power > 0.0 { product / power } else { 0.0 }
}

/// The least by which neighbours differ as a rule: of a rounded signal its step, of noise a small part of it. 0 where nothing changes.
pub fn resolution(values: &[f64]) -> f64 {
    let steps: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|step| *step > 0.0).collect();
    quantile(&steps, 0.05)
}

/// Runs of equal neighbouring values: first and last place of each run of at least `least` values.
pub fn runs(values: &[f64], least: usize) -> Vec<(usize, usize)> {
    let mut out = Vec::new();
    let mut from = 0;
    for place in 1..=values.len() {
        let goes_on = place < values.len() && values[place] == values[from];
        if !goes_on {
            if place - from >= least && values[from].is_finite() {
                out.push((from, place - 1));
            }
            from = place;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_equal_values_are_found() {
        assert_eq!(runs(&[1.0, 2.0, 2.0, 2.0, 3.0, 3.0], 2), [(1, 3), (4, 5)]);
        assert!(runs(&[], 1).is_empty());
    }
}
