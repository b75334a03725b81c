//! The scatter of a unit, moderated by that of all units.
//!
//! A unit with few recordings knows its own scatter badly, and a t with few degrees of freedom proves little. Units of one type scatter alike: the
//! variances of all give a scaled inverse χ² prior, and a unit's variance is the posterior mean of that and its own squares (Smyth, Linear models and
//! empirical Bayes methods, Stat. Appl. Genet. Mol. Biol. 3(1), 2004). Median and median deviation of the logarithms stand for Smyth's mean and variance,
//! so that units that change do not widen the prior (after Phipson et al., Ann. Appl. Stat. 10(2), 2016).

use super::statistics::{median, robust_deviation};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// Units that a prior takes, at the least.
pub const LEAST_UNITS: usize = 10;
/// A unit whose own variance is beyond this quantile of the prior's prediction scatters more than the fleet, and counts alone.
const UNLIKE: f64 = 0.95;
/// Asymptotic efficiency of a median of normal values, 2/π.
const OF_MEDIAN: f64 = std::f64::consts::FRAC_2_PI;

/// The scatter of any unit, by the whole fleet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Variance of a value about its unit's course.
    pub variance: f64,
    /// Degrees of freedom that it counts as.
    pub free: f64,
}

/// A variance of one unit with its degrees of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OfUnit {
    /// The variance.
    pub variance: f64,
    /// Its degrees of freedom.
    pub free: f64,
}

/// The variance of values by successive differences, which a single step or a ramp hardly moves (von Neumann 1941). `weight` as of a weighted mean, 1 on
/// average; of correlated values the squares of differences are smaller by 1 - correlation. `None` of fewer than three values.
pub fn by_differences(values: &[f64], weight: &[f64], correlation: f64) -> Option<OfUnit> {
    let count = values.len();
    if count < 3 || weight.len() != count {
        return None;
    }
    let squares: f64 = values.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
    let expected: f64 = weight.windows(2).map(|w| 1.0 / w[0] + 1.0 / w[1]).sum();
    let pairs = (count - 1) as f64;
    // Neighbouring differences share a value: their squares have the variance of this many independent ones.
    let free = 2.0 * pairs * pairs / (3.0 * pairs - 1.0);
    let variance = squares / expected / (1.0 - correlation.clamp(0.0, 0.9));
    (variance > 0.0).then_some(OfUnit { variance, free })
}

/// The prior of the variances of units; `None` of too few.
pub fn prior(units: &[OfUnit]) -> Option<Prior> {
    if units.len() < LEAST_UNITS {
        return None;
    }
    // A χ² of `free` degrees of freedom, per degree, has this median.
    let scaled: Vec<f64> = units
        .iter()
        .filter_map(|unit| Some(unit.variance * unit.free / ChiSquared::new(unit.free).ok()?.inverse_cdf(0.5)))
        .map(f64::ln)
        .filter(|log| log.is_finite())
        .collect();
    let own = units.iter().map(|unit| trigamma(0.5 * unit.free)).sum::<f64>() / units.len() as f64;
    let between = robust_deviation(&scaled).powi(2) - own;
    // A prior is no more certain than the values that it is from.
    let most = OF_MEDIAN * units.iter().map(|unit| unit.free).sum::<f64>();
    let free = if between > 0.0 { (2.0 * inverse_trigamma(between)).min(most) } else { most };
    Some(Prior { variance: median(&scaled).exp(), free })
}

impl Prior {
    /// Sum of squares and degrees of freedom that are added to those of a unit: none where the unit scatters more than the fleet does.
    pub fn added(&self, own: OfUnit) -> (f64, f64) {
        let limit = FisherSnedecor::new(own.free.max(1.0), self.free.max(1.0)).map_or(f64::INFINITY, |of| of.inverse_cdf(UNLIKE));
        match own.variance > limit * self.variance {
            true => (0.0, 0.0),
            false => (self.free * self.variance, self.free),
        }
    }
}

/// ψ'(x) by the recurrence ψ'(x) = 1/x² + ψ'(x + 1) (Abramowitz & Stegun 6.4.6), then by the asymptotic series 6.4.12.
fn trigamma(x: f64) -> f64 {
    let (mut x, mut sum) = (x.max(1e-8), 0.0);
    while x < 12.0 {
        sum += 1.0 / (x * x);
        x += 1.0;
    }
    let inverse = 1.0 / (x * x);
    sum + 1.0 / x + 0.5 * inverse + inverse / x * (1.0 / 6.0 - inverse * (1.0 / 30.0 - inverse / 42.0))
}

/// The x with ψ'(x) = y, by bisection of its logarithm; ψ' falls from ∞ to 0.
fn inverse_trigamma(y: f64) -> f64 {
    let (mut low, mut high) = (1e-6f64.ln(), 1e8f64.ln());
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if trigamma(middle.exp()) > y {
            low = middle;
        } else {
            high = middle;
        }
    }
    (0.5 * (low + high)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use statrs::function::gamma::digamma;

    #[test]
    fn trigamma_is_that_of_tables_and_the_slope_of_digamma() {
        // ψ'(1) = π²/6, ψ'(1/2) = π²/2.
        assert!((trigamma(1.0) - std::f64::consts::PI.powi(2) / 6.0).abs() < 1e-10);
        assert!((trigamma(0.5) - std::f64::consts::PI.powi(2) / 2.0).abs() < 1e-10);
        let slope = (digamma(7.3 + 1e-5) - digamma(7.3 - 1e-5)) / 2e-5;
        assert!((trigamma(7.3) - slope).abs() < 1e-7);
        assert!((inverse_trigamma(trigamma(3.7)) - 3.7).abs() < 1e-6);
    }

    fn variances(free: f64, prior: Option<f64>, seed: u64) -> Vec<OfUnit> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut square = |count: usize| -> f64 {
            (0..count)
                .map(|_| {
                    let x: f64 = StandardNormal.sample(&mut random);
                    x * x
                })
                .sum::<f64>()
                / count as f64
        };
        (0..400)
            .map(|_| {
                let true_one = 4.0 / prior.map_or(1.0, |free| square(free as usize));
                OfUnit { variance: true_one * square(free as usize), free }
            })
            .collect()
    }

    #[test]
    fn a_prior_is_that_which_the_variances_are_drawn_from() {
        let found = prior(&variances(10.0, Some(8.0), 1)).unwrap();
        assert!((found.variance / 4.0).ln().abs() < 0.15 && (4.0..16.0).contains(&found.free), "{found:?}");
        // Units of one variance give a prior as certain as all of them.
        let found = prior(&variances(10.0, None, 2)).unwrap();
        assert!((found.variance / 4.0).ln().abs() < 0.06 && found.free > 50.0, "{found:?}");
        assert_eq!(prior(&variances(10.0, None, 2)[..LEAST_UNITS - 1]), None);
    }

    #[test]
    fn a_unit_that_scatters_more_counts_alone() {
        let prior = Prior { variance: 1.0, free: 100.0 };
        assert_eq!(prior.added(OfUnit { variance: 9.0, free: 10.0 }), (0.0, 0.0));
        assert_eq!(prior.added(OfUnit { variance: 0.5, free: 10.0 }), (100.0, 100.0));
    }

    #[test]
    fn differences_give_the_variance_despite_a_step() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let (mut white, mut stepped) = (0.0, 0.0);
        for _ in 0..400 {
            let noise: Vec<f64> = (0..20).map(|_| StandardNormal.sample(&mut random)).collect();
            white += by_differences(&noise, &[1.0; 20], 0.0).unwrap().variance / 400.0;
            let step: Vec<f64> = noise.iter().enumerate().map(|(i, e)| e + if i >= 6 { 2.0 } else { 0.0 }).collect();
            stepped += by_differences(&step, &[1.0; 20], 0.0).unwrap().variance / 400.0;
        }
        // The step adds its square to one of 19 differences: 4 / (2 x 19).
        assert!((white - 1.0).abs() < 0.05 && (stepped - 1.0 - 4.0 / 38.0).abs() < 0.06, "{white} {stepped}");
    }
}
