//! Figures of columns.

use backdrive_control::butterworth::Butterworth;

/// Mean; NaN of nothing.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Root of the mean square; NaN of nothing.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Pearson's correlation coefficient, -1 to 1, over the length that both have; NaN where one is constant.
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let count = a.len().min(b.len());
    let (a, b) = (&a[..count], &b[..count]);
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(x, y)| f(x - ma, y - mb)).sum::<f64>();
    sum(&|x, y| x * y) / (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt()
}

/// The column forward and backward through a Butterworth low-pass of second order: nothing is delayed, the corner (Hz) has half the amplitude.
pub fn smooth(values: &[f64], corner_hz: f64, period_s: f64) -> Vec<f64> {
    let pass = |values: &mut Vec<f64>| {
        let mut filter = Butterworth::new(2, corner_hz, period_s);
        values.iter_mut().for_each(|v| *v = filter.step(*v));
        values.reverse();
    };
    let mut values = values.to_vec();
    pass(&mut values);
    pass(&mut values);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlation_is_pearsons() {
        let a = [1.0, 2.0, 3.0, 5.0];
        assert!((correlation(&a, &a.map(|x| 4.0 - 2.0 * x)) + 1.0).abs() < 1e-12);
        // By hand: sums of products 5.5, 8.75 and 8.75 about the means.
        let b = [2.0, 1.0, 5.0, 3.0];
        assert!((correlation(&a, &b) - 3.75 / 8.75).abs() < 1e-12, "{}", correlation(&a, &b));
    }

    #[test]
    fn smoothing_delays_nothing() {
        let sine: Vec<f64> = (0..4000).map(|k| (k as f64 * 0.01).sin()).collect();
        let smoothed = smooth(&sine, 50.0, 1e-3);
        let worst = sine.iter().zip(&smoothed).skip(500).take(3000).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-3, "{worst}");
    }
}
