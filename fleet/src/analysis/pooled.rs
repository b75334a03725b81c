//! Parameters of each unit by partial pooling: an empirical Bayes estimate with a normal prior that the fleet itself gives.
//!
//! A recording's estimate is `μ + u_unit + w_recording + e`: the variance of e is known from the recording, those of w and u are estimated
//! ([`added_variance`]). Given them the posterior of a unit is a closed form, and its variance has Morris' terms for the estimated mean and shrinkage
//! (Morris, Parametric empirical Bayes inference, JASA 78(381), 1983).

use super::statistics::{Group, added_variance, weighted_mean};
use serde::Serialize;
use std::collections::BTreeMap;

/// 97.5 % quantile of the standard normal distribution.
const Z: f64 = 1.959_963_985;

/// A parameter over the fleet.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pooled {
    /// Mean over the units.
    pub mean: f64,
    /// Its standard error.
    pub mean_sd: f64,
    /// Standard deviation between units.
    pub between_sd: f64,
    /// Standard deviation between recordings of a unit, beside the errors of the single recordings.
    pub within_sd: f64,
    /// Each unit.
    pub units: BTreeMap<String, OfUnit>,
}

/// A parameter of a unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OfUnit {
    /// Recordings.
    pub recordings: usize,
    /// By the unit's own recordings alone.
    pub own: f64,
    /// Its standard error.
    pub own_sd: f64,
    /// Share of the way to the fleet's mean, 0 to 1.
    pub shrinkage: f64,
    /// Pooled estimate.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
}

/// Pools estimates of units, each with its known variances.
pub fn pooled(units: &BTreeMap<String, Group>) -> Option<Pooled> {
    let groups: Vec<Group> = units.values().filter(|(values, _)| !values.is_empty()).cloned().collect();
    if groups.is_empty() {
        return None;
    }
    let within = added_variance(&groups);
    let of = |(values, variances): &Group| {
        let all: Vec<f64> = variances.iter().map(|v| v + within).collect();
        weighted_mean(values, &all)
    };
    let (means, variances): (Vec<f64>, Vec<f64>) = groups.iter().map(of).unzip();
    let between = added_variance(&[(means.clone(), variances.clone())]);
    let (mean, mean_variance) = weighted_mean(&means, &variances.iter().map(|v| v + between).collect::<Vec<_>>());
    let count = means.len() as f64;
    let mut out = BTreeMap::new();
    for (name, group) in units.iter().filter(|(_, (values, _))| !values.is_empty()) {
        let (own, variance) = of(group);
        // The factor (U - 3) / (U - 1) makes the estimated shrinkage an unbiased one; fewer than four units are not pooled.
        let shrinkage = if count < 4.0 { 0.0 } else { (count - 3.0) / (count - 1.0) * variance / (variance + between) };
        let value = own + shrinkage * (mean - own);
        let of_shrinkage = if count < 4.0 { 0.0 } else { 2.0 / (count - 3.0) * shrinkage.powi(2) * (own - mean).powi(2) };
        let sd = (variance * (1.0 - (count - 1.0) / count * shrinkage) + of_shrinkage).sqrt();
        out.insert(
            name.clone(),
            OfUnit {
                recordings: group.0.len(),
                own,
                own_sd: variance.sqrt(),
                shrinkage,
                value,
                sd,
                ci95: [value - Z * sd, value + Z * sd],
            },
        );
    }
    Some(Pooled { mean, mean_sd: mean_variance.sqrt(), between_sd: between.sqrt(), within_sd: within.sqrt(), units: out })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn intervals_cover_the_truth_and_are_narrower_than_without_pooling() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let (mut covered, mut all, mut own, mut together) = (0, 0, 0.0, 0.0);
        for _ in 0..100 {
            let mut truths = BTreeMap::new();
            let mut units = BTreeMap::new();
            for unit in 0..20 {
                let truth = 3.0 + 0.2 * normal();
                let count = 2 + unit % 5;
                let values = (0..count).map(|_| truth + 0.3 * normal() + 0.1 * normal()).collect();
                units.insert(format!("{unit:02}"), (values, vec![0.01; count]));
                truths.insert(format!("{unit:02}"), truth);
            }
            let pooled = pooled(&units).unwrap();
            for (unit, found) in &pooled.units {
                let truth = truths[unit];
                covered += usize::from(found.ci95[0] <= truth && truth <= found.ci95[1]);
                all += 1;
                own += (found.own - truth).powi(2);
                together += (found.value - truth).powi(2);
            }
        }
        let share = f64::from(covered as u32) / f64::from(all);
        assert!((0.93..0.98).contains(&share), "{share}");
        assert!(together < 0.7 * own, "{together} {own}");
    }

    #[test]
    fn many_recordings_keep_their_own_value() {
        let unit = |level: f64, count: usize| ([level, level + 0.02].repeat(count), vec![1e-6; 2 * count]);
        let units = (0..8).map(|u| (u.to_string(), unit(f64::from(u), 200))).collect();
        let found = pooled(&units).unwrap();
        assert!(found.units["7"].shrinkage < 1e-5 && (found.units["7"].value - 7.01).abs() < 1e-4);
        assert!((found.between_sd - 6.0f64.sqrt()).abs() < 1e-3, "{}", found.between_sd);
    }
}
