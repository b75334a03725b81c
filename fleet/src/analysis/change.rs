//! A change point in the values of one unit: a step, or a rise from a date on.
//!
//! For each place the values after it are compared with those before it (least squares, Student's t). The smallest p-value is multiplied by the number of
//! comparisons (Bonferroni), and t is reduced by the square root of (1 + r) / (1 - r) where successive residuals are correlated with r > 0. The scatter
//! is that of the unit, moderated by the fleet's where there is a [`Prior`].

use super::moderated::{OfUnit, Prior, by_differences};
use super::statistics::{t_975, two_sided};
use serde::Serialize;

/// Recordings before a change and since it, at the least.
pub const LEAST: usize = 3;
/// Recordings in all, at the least.
pub const LEAST_ALL: usize = 8;
/// Twice the difference of log likelihoods up to which a place is a possible one: the 95 % quantile of χ² with one degree of freedom.
const POSSIBLE: f64 = 3.841;

/// The shape of a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// At once.
    Step,
    /// In proportion to the time since then.
    Ramp,
}

/// The change point that explains the values best.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The shape.
    pub shape: Shape,
    /// Index of the first value since the change.
    pub at: usize,
    /// First and last place that is possible at 95 %.
    pub possible: [usize; 2],
    /// Level before.
    pub before: f64,
    /// Change: of a step its height, of a ramp its height at the last value.
    pub effect: f64,
    /// 95 % interval of the change, over all possible places.
    pub interval: [f64; 2],
    /// Probability of a change as clear as this where there is none, at most.
    pub p: f64,
}

struct Place {
    shape: Shape,
    at: usize,
    before: f64,
    effect: f64,
    /// Sum of weighted squares.
    left: f64,
    /// Of the effect, per weighted standard deviation of a value.
    size: f64,
}

/// Searches values in their order. `time`: of each value, rising; `variance`: of each, up to a common factor; `correlation`: of successive residuals;
/// `least`: the size up to which a change counts as none; `prior`: how values of a unit scatter in the fleet.
pub fn change(values: &[f64], time: &[f64], variance: &[f64], correlation: f64, least: f64, prior: Option<Prior>) -> Option<Found> {
    let count = values.len();
    if count < LEAST_ALL || time.len() != count || variance.len() != count {
        return None;
    }
    let weight = weights(variance);
    let total: f64 = weight.iter().sum();
    let mean = values.iter().zip(&weight).map(|(y, w)| w * y).sum::<f64>() / total;
    let all: f64 = values.iter().zip(&weight).map(|(y, w)| w * (y - mean).powi(2)).sum();
    let mut places = Vec::new();
    for at in LEAST..=count - LEAST {
        let step: Vec<f64> = (0..count).map(|i| f64::from(u8::from(i >= at))).collect();
        places.extend(placed(Shape::Step, at, &step, values, &weight));
        let (from, to) = (time[at - 1], time[count - 1]);
        if to > from {
            let ramp: Vec<f64> = time.iter().map(|t| ((t - from) / (to - from)).max(0.0)).collect();
            places.extend(placed(Shape::Ramp, at, &ramp, values, &weight));
        }
    }
    let best = places.iter().min_by(|a, b| a.left.total_cmp(&b.left))?;
    let own = (count - 2) as f64;
    let r = correlation.clamp(0.0, 0.9);
    let inflation = ((1.0 + r) / (1.0 - r)).sqrt();
    // Values that a step explains to the last bit are no measurement; a share of a billionth keeps the t finite.
    let left = |place: &Place| place.left.max(1e-18 * all);
    let (added, of_fleet) = prior.map_or((0.0, 0.0), |prior| prior.added(OfUnit { variance: left(best) / own, free: own }));
    let free = own + of_fleet;
    let sd = |place: &Place| ((added + left(place)) / free).sqrt();
    let error = |place: &Place| sd(place) * place.size * inflation;
    let t = (best.effect.abs() - least).max(0.0) / error(best);
    let p = (two_sided(t, free) * places.len() as f64).min(1.0);
    let all_free = count as f64 + of_fleet;
    let near = |place: &&Place| all_free / inflation.powi(2) * ((added + left(place)) / (added + left(best))).ln() <= POSSIBLE;
    let possible: Vec<&Place> = places.iter().filter(|place| place.shape == best.shape).filter(near).collect();
    let wide = t_975(free);
    let low = possible.iter().map(|place| place.effect - wide * error(place)).fold(f64::INFINITY, f64::min);
    let high = possible.iter().map(|place| place.effect + wide * error(place)).fold(f64::NEG_INFINITY, f64::max);
    Some(Found {
        shape: best.shape,
        at: best.at,
        possible: [possible.iter().map(|p| p.at).min()?, possible.iter().map(|p| p.at).max()?],
        before: best.before,
        effect: best.effect,
        interval: [low, high],
        p,
    })
}

/// Weights of values, 1 on average.
fn weights(variance: &[f64]) -> Vec<f64> {
    let weight: Vec<f64> = variance.iter().map(|v| 1.0 / v.max(f64::MIN_POSITIVE)).collect();
    let scale = weight.iter().sum::<f64>() / weight.len().max(1) as f64;
    weight.iter().map(|w| w / scale).collect()
}

/// How values of a unit scatter by their successive differences, in the scale of [`change`].
pub fn scatter(values: &[f64], variance: &[f64], correlation: f64) -> Option<OfUnit> {
    (values.len() >= LEAST_ALL).then(|| by_differences(values, &weights(variance), correlation))?
}

/// Weighted least squares of a level and a multiple of a shape.
fn placed(shape: Shape, at: usize, x: &[f64], values: &[f64], weight: &[f64]) -> Option<Place> {
    let total: f64 = weight.iter().sum();
    let mean = |of: &[f64]| of.iter().zip(weight).map(|(x, w)| w * x).sum::<f64>() / total;
    let (mx, my) = (mean(x), mean(values));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for ((x, y), w) in x.iter().zip(values).zip(weight) {
        xx += w * (x - mx).powi(2);
        xy += w * (x - mx) * (y - my);
        yy += w * (y - my).powi(2);
    }
    if xx <= 0.0 {
        return None;
    }
    let effect = xy / xx;
    Some(Place { shape, at, before: my - effect * mx, effect, left: (yy - effect * xy).max(0.0), size: 1.0 / xx.sqrt() })
}

/// Correlation of successive residuals about the change point that explains the values best; `None` where there are too few.
pub fn successive(values: &[f64], time: &[f64], variance: &[f64]) -> Option<f64> {
    let found = change(values, time, variance, 0.0, 0.0, None)?;
    let (from, to) = (time[found.at - 1], time[values.len() - 1]);
    let shape = |i: usize| match found.shape {
        Shape::Step => f64::from(u8::from(i >= found.at)),
        Shape::Ramp => ((time[i] - from) / (to - from)).max(0.0),
    };
    let left: Vec<f64> = values.iter().enumerate().map(|(i, y)| y - found.before - found.effect * shape(i)).collect();
    let energy: f64 = left.iter().map(|x| x * x).sum();
    // Three fitted numbers draw the correlation of white residuals down by about 3 / n.
    let bias = 3.0 / left.len() as f64;
    (energy > 0.0).then(|| left.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / energy + bias)
}

#[cfg(test)]
mod tests {
    use super::super::moderated::prior;
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn noise(count: usize, seed: u64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..count).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    fn time(count: usize) -> Vec<f64> {
        (0..count).map(|i| i as f64).collect()
    }

    #[test]
    fn a_step_is_found_with_its_size_and_date() {
        let values: Vec<f64> = noise(40, 1).iter().enumerate().map(|(i, e)| 10.0 + if i >= 25 { 2.0 } else { 0.0 } + 0.3 * e).collect();
        let found = change(&values, &time(40), &[1.0; 40], 0.0, 0.0, None).unwrap();
        assert_eq!((found.shape, found.at), (Shape::Step, 25));
        assert!(found.interval[0] < 2.0 && found.interval[1] > 2.0 && found.interval[1] - found.interval[0] < 0.6, "{found:?}");
        // The t of two samples with pooled variance is that of the textbook.
        let (a, b) = (&values[..25], &values[25..]);
        let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
        let squares = |x: &[f64]| x.iter().map(|v| (v - mean(x)).powi(2)).sum::<f64>();
        let sd = ((squares(a) + squares(b)) / 38.0).sqrt();
        let t = (mean(b) - mean(a)) / (sd * (1.0 / 25.0 + 1.0 / 15.0f64).sqrt());
        let comparisons = 2.0 * 35.0;
        assert!((found.p / (comparisons * two_sided(t, 38.0)) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_ramp_is_told_from_a_step() {
        let values: Vec<f64> = noise(50, 2).iter().enumerate().map(|(i, e)| 1.0 + 0.1 * (i as f64 - 29.0).max(0.0) + 0.1 * e).collect();
        let found = change(&values, &time(50), &[1.0; 50], 0.0, 0.0, None).unwrap();
        assert_eq!(found.shape, Shape::Ramp);
        assert!(found.possible[0] <= 30 && found.possible[1] >= 30 && (found.effect - 2.0).abs() < 0.3, "{found:?}");
    }

    #[test]
    fn without_a_change_few_p_values_are_small() {
        let small = |correlated: f64, known: f64| {
            let p = |seed: u64| {
                let mut state = 0.0;
                let values: Vec<f64> = noise(50, seed)
                    .iter()
                    .map(|e| {
                        state = correlated * state + (1.0 - correlated * correlated).sqrt() * e;
                        state
                    })
                    .collect();
                change(&values, &time(50), &[1.0; 50], known, 0.0, None).map_or(1.0, |found| found.p)
            };
            (0..1000).filter(|seed| p(*seed) < 0.01).count()
        };
        // Of 1000 at most 10 are expected, and a Poisson count of 10 exceeds 20 with a probability below 0.002.
        assert!(small(0.0, 0.0) <= 20, "{}", small(0.0, 0.0));
        assert!(small(0.4, 0.4) <= 20, "{}", small(0.4, 0.4));
    }

    #[test]
    fn the_scatter_of_the_fleet_finds_an_early_step_and_names_no_more_without_one() {
        // Scatter differs from unit to unit by a χ² with twenty degrees of freedom.
        let fleet = |seed: u64| -> Vec<Vec<f64>> {
            let scale = noise(20 * 60, seed + 1000);
            let sd = |unit: usize| (20.0 / scale[20 * unit..20 * unit + 20].iter().map(|x| x * x).sum::<f64>()).sqrt();
            (0..60).map(|unit| noise(14, 100 * seed + unit as u64).iter().map(|e| sd(unit) * e).collect()).collect()
        };
        let even = [1.0; 14];
        let prior_of = |units: &[Vec<f64>]| prior(&units.iter().filter_map(|unit| scatter(unit, &even, 0.0)).collect::<Vec<_>>());
        let mut small = 0;
        for seed in 0..20 {
            let units = fleet(seed);
            let known = prior_of(&units);
            small += units.iter().filter(|unit| change(unit, &time(14), &even, 0.0, 0.0, known).unwrap().p < 0.01).count();
        }
        // Of 1200 at most 12 are expected, and a Poisson count of 12 exceeds 24 with a probability below 0.001.
        assert!(small <= 24, "{small}");
        // A step of six times the scatter after four recordings.
        let mut units = fleet(50);
        units[0].iter_mut().skip(4).for_each(|value| *value += 6.0);
        let alone = change(&units[0], &time(14), &even, 0.0, 0.0, None).unwrap();
        let with = change(&units[0], &time(14), &even, 0.0, 0.0, prior_of(&units)).unwrap();
        assert!(with.p < 0.1 * alone.p && with.p < 1e-6 && with.at == 4, "{with:?} {alone:?}");
    }
}
