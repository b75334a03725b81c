//! Statistics of weighted values, variances between groups, and false discoveries.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Iterations of a root search by bisection: beyond the resolution of doubles.
const HALVINGS: usize = 200;

/// Weighted mean and its variance where each weight is the reciprocal of a variance.
pub fn weighted_mean(values: &[f64], variances: &[f64]) -> (f64, f64) {
    let (sum, weight) = values.iter().zip(variances).fold((0.0, 0.0), |(sum, weight), (y, v)| (sum + y / v, weight + 1.0 / v));
    (sum / weight, 1.0 / weight)
}

/// A groups' values with the known part of their variances.
pub type Group = (Vec<f64>, Vec<f64>);

/// The variance that has to be added to the known variances so that the weighted squares about the means of the groups are as large as expected
/// (Paule & Mandel 1982). 0 where the known variances explain all.
pub fn added_variance(groups: &[Group]) -> f64 {
    let free: f64 = groups.iter().map(|(values, _)| values.len().saturating_sub(1) as f64).sum();
    let squares = |added: f64| -> f64 {
        let of = |(values, variances): &Group| {
            let all: Vec<f64> = variances.iter().map(|v| (v + added).max(f64::MIN_POSITIVE)).collect();
            if values.is_empty() {
                return 0.0;
            }
            let mean = weighted_mean(values, &all).0;
            values.iter().zip(&all).map(|(y, v)| (y - mean).powi(2) / v).sum::<f64>()
        };
        groups.iter().map(of).sum()
    };
    if free <= 0.0 || squares(0.0) <= free {
        return 0.0;
    }
    let spread = |(values, _): &Group| {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        values.iter().map(|y| (y - mean).powi(2)).sum::<f64>()
    };
    // With this much the squares are below their expectation: no weighted sum about the weighted mean exceeds that about the mean.
    let (mut low, mut high) = (0.0, groups.iter().map(spread).sum::<f64>() / free);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if squares(middle) > free {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The square of a larger one is not finite.
const LARGEST_T: f64 = 1e100;

/// Probability that Student's t with `free` degrees of freedom is beyond ±`t`.
pub fn two_sided(t: f64, free: f64) -> f64 {
    // Of values without any scatter and without a change 0 / 0 is no evidence.
    if t.is_nan() {
        return 1.0;
    }
    StudentsT::new(0.0, 1.0, free.max(1.0)).map_or(1.0, |of| 2.0 * of.cdf(-t.abs().min(LARGEST_T)))
}

/// The value that Student's t exceeds with a probability of 2.5 %.
pub fn t_975(free: f64) -> f64 {
    StudentsT::new(0.0, 1.0, free.max(1.0)).map_or(f64::INFINITY, |of| of.inverse_cdf(0.975))
}

/// Adjusted p-values of Benjamini & Hochberg (1995): the smallest false discovery rate at which each is a discovery.
pub fn adjusted(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*b].total_cmp(&p[*a]));
    let count = p.len() as f64;
    let mut out = vec![1.0; p.len()];
    let mut least = 1.0f64;
    for (place, index) in order.into_iter().enumerate() {
        least = least.min(p[index] * count / (count - place as f64));
        out[index] = least;
    }
    out
}

/// Median; 0 of no values.
pub fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    backdrive_signal::statistics::middle(&mut values).unwrap_or(0.0)
}

/// A standard deviation from the median of absolute deviations, which a few odd values do not move.
pub fn robust_deviation(values: &[f64]) -> f64 {
    let middle = median(values);
    // 1 / Φ⁻¹(3/4): of a normal distribution it is the standard deviation.
    1.482_602_218_505_602 * median(&values.iter().map(|x| (x - middle).abs()).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variance_of_equal_errors_is_the_closed_form() {
        // With equal known variances the estimate is the sample variance less the known one.
        let values = vec![1.0, 4.0, 2.0, 7.0, 6.0];
        let sample = 6.5;
        let found = added_variance(&[(values.clone(), vec![0.5; 5])]);
        assert!((found - (sample - 0.5)).abs() < 1e-9, "{found}");
        assert_eq!(added_variance(&[(values, vec![10.0; 5])]), 0.0);
    }

    #[test]
    fn adjusted_p_values_are_those_of_the_paper() {
        // Benjamini & Hochberg 1995, section 3.2: of 15 p-values the four smallest are discoveries at 0.05.
        let p = [0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719, 0.6528, 0.7590, 1.0];
        let q = adjusted(&p);
        assert_eq!(q.iter().filter(|q| **q <= 0.05).count(), 4);
        assert!((q[0] - 0.0015).abs() < 1e-12 && (q[14] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn quantiles_of_student_are_those_of_tables() {
        assert!((t_975(10.0) - 2.228).abs() < 1e-3);
        assert!((two_sided(2.228, 10.0) - 0.05).abs() < 1e-4);
        assert_eq!((two_sided(f64::NAN, 10.0), two_sided(f64::INFINITY, 10.0)), (1.0, two_sided(1e100, 10.0)));
    }
}
