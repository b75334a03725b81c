//! What the fleet does together: a shift of each date that all units share, as after a change of firmware or of the weather.

use super::observations::Observations;
use super::statistics::median;
use std::collections::{BTreeMap, BTreeSet};

/// Units that a shift of a date takes besides the unit itself, at the least.
pub const LEAST_UNITS: usize = 5;
/// Units that a common factor takes, at the least.
const LEAST_OF_FACTOR: usize = 10;

/// The common shift at each date, and the values without it.
pub struct Common {
    /// Days since 1970 of each interval of dates, its first and its last.
    pub days: Vec<(i64, i64)>,
    /// The fleet's shift there, by the median of all units.
    pub shift: Vec<f64>,
    /// Number of units there.
    pub units: Vec<usize>,
    /// By unit: the values without the shift of the other units.
    pub values: BTreeMap<String, Vec<f64>>,
    /// Whether there were units enough for a common shift to be removed.
    pub is_removed: bool,
}

/// Removes the common shift. Values without a date stay. A shift is the median over the other units of their values less their own medians, so that a
/// few units that change do not move it, and none hides its own change. A change of the torque's scale moves each unit in proportion to its level: that
/// factor is estimated too, as the weighted median of (deviation - shift) / (level - fleet's level), which is the least absolute deviation.
pub fn common(of: &Observations) -> Common {
    let raw: BTreeMap<String, Vec<f64>> =
        of.units.iter().map(|(unit, all)| (unit.clone(), all.iter().map(|observation| observation.value).collect())).collect();
    let days = intervals(of);
    if days.is_empty() {
        return Common { days, shift: Vec::new(), units: Vec::new(), values: raw, is_removed: false };
    }
    let interval = |day: i64| days.partition_point(|(_, last)| *last < day).min(days.len() - 1);
    let mut deviations: Vec<Vec<(f64, usize)>> = vec![Vec::new(); days.len()];
    for (index, (unit, all)) in of.units.iter().enumerate() {
        let middle = median(&raw[unit]);
        // One value for each unit and interval, so that a unit with many recordings has one vote.
        let mut here: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for observation in all {
            if let Some(date) = observation.date {
                here.entry(interval(date.days())).or_default().push(observation.value - middle);
            }
        }
        here.into_iter().for_each(|(interval, values)| deviations[interval].push((median(&values), index)));
    }
    deviations.iter_mut().for_each(|all| all.sort_by(|a, b| a.0.total_cmp(&b.0)));
    let shift: Vec<f64> = deviations.iter().map(|all| middle_without(all, usize::MAX)).collect();
    let levels: Vec<f64> = raw.values().map(|values| median(values)).collect();
    let middle = median(&levels);
    let factors: Vec<f64> = deviations.iter().zip(&shift).map(|(all, shift)| factor(all, *shift, &levels, middle)).collect();
    let mut values = raw;
    for (index, (unit, all)) in of.units.iter().enumerate() {
        let off = levels[index] - middle;
        let own: Vec<f64> = deviations.iter().zip(&factors).map(|(all, factor)| middle_without(all, index) + factor * off).collect();
        let Some(values) = values.get_mut(unit) else { continue };
        for (value, observation) in values.iter_mut().zip(all) {
            if let Some(date) = observation.date {
                *value -= own[interval(date.days())];
            }
        }
    }
    let units = deviations.iter().map(Vec::len).collect();
    Common { days, shift, units, values, is_removed: true }
}

/// By what share of their levels the units moved beside the common shift.
fn factor(deviations: &[(f64, usize)], shift: f64, levels: &[f64], middle: f64) -> f64 {
    if deviations.len() < LEAST_OF_FACTOR {
        return 0.0;
    }
    let ratio = |(deviation, unit): &(f64, usize)| {
        let off = levels[*unit] - middle;
        (off != 0.0).then(|| ((deviation - shift) / off, off.abs()))
    };
    let mut ratios: Vec<(f64, f64)> = deviations.iter().filter_map(ratio).collect();
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * ratios.iter().map(|ratio| ratio.1).sum::<f64>();
    let mut sum = 0.0;
    let at = ratios.iter().find(|(_, weight)| {
        sum += weight;
        sum >= half
    });
    at.map_or(0.0, |(ratio, _)| *ratio)
}

/// The median of sorted deviations without those of one unit.
fn middle_without(sorted: &[(f64, usize)], unit: usize) -> f64 {
    let place = sorted.iter().position(|(_, other)| *other == unit);
    let count = sorted.len() - usize::from(place.is_some());
    if count == 0 {
        return 0.0;
    }
    let at = |index: usize| sorted[index + usize::from(place.is_some_and(|place| place <= index))].0;
    0.5 * (at((count - 1) / 2) + at(count / 2))
}

/// Intervals of days with enough units in each; none where the fleet has too few.
fn intervals(of: &Observations) -> Vec<(i64, i64)> {
    let mut by_day: BTreeMap<i64, BTreeSet<usize>> = BTreeMap::new();
    for (index, all) in of.units.values().enumerate() {
        for date in all.iter().filter_map(|observation| observation.date) {
            by_day.entry(date.days()).or_default().insert(index);
        }
    }
    let mut out: Vec<(i64, i64)> = Vec::new();
    let mut here: BTreeSet<usize> = BTreeSet::new();
    let mut first = None;
    for (day, units) in by_day {
        here.extend(units);
        first.get_or_insert(day);
        if here.len() > LEAST_UNITS {
            out.push((first.take().unwrap_or(day), day));
            here.clear();
        }
    }
    // A rest with too few units belongs to the interval before.
    if let (Some(_), Some(last)) = (first, out.last_mut()) {
        last.1 = i64::MAX;
    }
    out
}
