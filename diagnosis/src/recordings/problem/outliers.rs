//! Single samples that no device can have made, such as those of a sensor that starts up, or a lost frame.

use crate::tuning::tuning;

/// Samples that stand alone, far outside the range of their signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Outliers {
    /// The signal.
    pub signal: String,
    /// How many there are.
    pub count: usize,
    /// Time of the first, s from the first sample.
    pub first: f64,
    /// How far it is from its neighbours, in ranges of the signal.
    pub size: f64,
    /// Whether they were put between their neighbours, or left as they are.
    pub replaced: bool,
}

/// Places of such samples in a signal, and how far each is from its neighbours in ranges of the signal.
pub(super) fn places(samples: &[f64]) -> Vec<(usize, f64)> {
    if samples.len() < 3 {
        return Vec::new();
    }
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (Some(low), Some(high)) = (sorted.get(samples.len() / 100), sorted.get(samples.len() - 1 - samples.len() / 100)) else {
        return Vec::new();
    };
    let range = high - low;
    if range <= 0.0 {
        return Vec::new();
    }
    let away = |i: usize| (samples[i] - beside(samples, i)).abs() / range;
    let alone = |i: &usize| {
        let neighbours = [i.checked_sub(1), Some(i + 1)].into_iter().flatten().filter_map(|k| samples.get(k));
        neighbours.into_iter().all(|x| (low - range..=high + range).contains(x))
    };
    (0..samples.len()).filter(alone).map(|i| (i, away(i))).filter(|(_, size)| *size > tuning().recordings.outlier).collect()
}

/// What a sample would be between its neighbours; at an end as its neighbour is.
pub(super) fn beside(samples: &[f64], i: usize) -> f64 {
    match (i.checked_sub(1).and_then(|k| samples.get(k)), samples.get(i + 1)) {
        (Some(before), Some(after)) => 0.5 * (before + after),
        (Some(one), None) | (None, Some(one)) => *one,
        (None, None) => samples.get(i).copied().unwrap_or(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_that_stands_alone_is_found_and_a_step_or_an_impact_is_not() {
        let mut wave: Vec<f64> = (0..500).map(|i| (0.05 * f64::from(i)).sin()).collect();
        assert!(places(&wave).is_empty());
        (wave[0], wave[200]) = (120.0, -9.0);
        let found = places(&wave);
        assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), [0, 200]);
        assert!((found[0].1 - 60.0).abs() < 0.5, "{found:?}");
        let step: Vec<f64> = (0..500).map(|i| if i < 250 { 0.0 } else { 7.0 }).collect();
        let impact: Vec<f64> = (0..500).map(|i| if i == 250 { 50.0 } else { 0.0 }).collect();
        assert!(places(&step).is_empty() && places(&impact).is_empty() && places(&[]).is_empty());
    }
}
