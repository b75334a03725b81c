//! Statistics of values: of slices, or of anything that gives numbers one after another.

use std::borrow::Borrow;

/// Mean; 0 of nothing.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Root mean square; 0 of nothing.
pub fn rms(values: impl IntoIterator<Item: Borrow<f64>>) -> f64 {
    let (sum, count) = squares(values);
    (sum / count.max(1) as f64).sqrt()
}

/// Root mean square of the finite values; `None` where there are none.
pub fn rms_of_finite(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (sum, count) = squares(values.into_iter().filter(|x| x.is_finite()));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

fn squares(values: impl IntoIterator<Item: Borrow<f64>>) -> (f64, usize) {
    values.into_iter().fold((0.0, 0), |(sum, count), x| (sum + x.borrow() * x.borrow(), count + 1))
}

/// Standard deviation about the mean, of all values and not of a sample of more; 0 of nothing.
pub fn deviation(values: &[f64]) -> f64 {
    let middle = mean(values);
    (values.iter().map(|x| (x - middle).powi(2)).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The median: of an even number of values the mean of the middle two. `None` of nothing.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

/// The middle value: of an even number of values the upper of the middle two. `values` is reordered; `None` of nothing.
pub fn middle(values: &mut [f64]) -> Option<f64> {
    let place = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(place, f64::total_cmp).1)
}

/// The middle one of the steps between times in their order; `None` of fewer than two.
pub fn middle_step(times: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    middle(&mut steps)
}

/// The value below which this share of sorted values lies, between the two that lie beside it (as NumPy's `quantile`); NaN of nothing.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len().max(1) - 1) as f64;
    let at = |place: f64| sorted.get(place as usize).copied().unwrap_or(f64::NAN);
    let (below, above) = (at(place.floor()), at(place.ceil()));
    below + (above - below) * place.fract()
}

/// Pearson's correlation coefficient, -1 to 1, over the length that both have; NaN where one is constant.
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let count = a.len().min(b.len());
    let (a, b) = (&a[..count], &b[..count]);
    let (ma, mb) = (mean(a), mean(b));
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        xx += (x - ma) * (x - ma);
        yy += (y - mb) * (y - mb);
        xy += (x - ma) * (y - mb);
    }
    xy / (xx * yy).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_those_of_their_formulas() {
        assert_eq!((mean(&[1.0, 2.0, 6.0]), mean(&[])), (3.0, 0.0));
        assert_eq!((rms([3.0, 4.0, 5.0]), rms([0.0; 0])), ((50.0f64 / 3.0).sqrt(), 0.0));
        assert_eq!((rms_of_finite([1.0, f64::NAN, -1.0]), rms_of_finite([f64::NAN])), (Some(1.0), None));
        assert_eq!((deviation(&[1.0, 3.0]), deviation(&[])), (1.0, 0.0));
    }

    #[test]
    fn of_an_even_number_the_median_lies_between_and_the_middle_is_the_upper_one() {
        assert_eq!((median(vec![4.0, 1.0, 2.0]), median(vec![4.0, 1.0, 2.0, 3.0]), median(Vec::new())), (Some(2.0), Some(2.5), None));
        assert_eq!((middle(&mut [4.0, 1.0, 2.0]), middle(&mut [4.0, 1.0, 2.0, 3.0]), middle(&mut [])), (Some(2.0), Some(3.0), None));
        assert_eq!((middle_step(&[0.0, 1.0, 3.0, 4.0]), middle_step(&[1.0])), (Some(1.0), None));
    }

    #[test]
    fn a_quantile_lies_between_its_neighbours() {
        let sorted = [1.0, 2.0, 4.0, 8.0];
        assert_eq!([0.0, 0.5, 1.0].map(|share| quantile(&sorted, share)), [1.0, 3.0, 8.0]);
        assert!(quantile(&[], 0.5).is_nan());
    }

    #[test]
    fn correlation_is_pearsons() {
        let a = [1.0, 2.0, 3.0, 5.0];
        assert!((correlation(&a, &a.map(|x| 4.0 - 2.0 * x)) + 1.0).abs() < 1e-12);
        // By hand: sums of products 3.75, 8.75 and 8.75 about the means.
        assert!((correlation(&a, &[2.0, 1.0, 5.0, 3.0]) - 3.75 / 8.75).abs() < 1e-12);
        assert!(correlation(&a, &[7.0; 4]).is_nan());
    }
}
