//! Single samples that no device can have made.

use crate::finding::{Finding, FindingKind};
use crate::numeric::{extremes, median, quantile};
use crate::quantity::Quantity;
use crate::recording::{Recording, Signal};

/// A position is an outlier above this number of usual deviations from its neighbours, and this share of its range: a mass does not jump and come back
/// within two samples.
const OF_POSITION: [f64; 2] = [20.0, 0.08];
/// Another signal is one where it leaves the range of all other samples by this share of it.
const BEYOND: f64 = 0.5;
/// It is at least this number of usual steps away: a count of a sensor is no outlier.
const STEPS: f64 = 4.0;
/// Outliers are few: beyond this share of the samples the signal is like that.
const FEW: f64 = 0.01;

/// Finds them, and puts the samples between their neighbours on the even clock, so that they do not count where signals are compared.
pub fn check(recording: &mut Recording, out: &mut Vec<Finding>) {
    for place in 0..recording.signals.len() {
        let found = places(&recording.signals[place]);
        if let Some(first) = found.first() {
            out.push(finding(recording, &recording.signals[place], *first, &found));
            mend(recording, place, &found);
        }
    }
}

/// Replaces each sample and its neighbours by the line between those beside them.
fn mend(recording: &mut Recording, place: usize, found: &[usize]) {
    let stream = recording.stream(&recording.signals[place]);
    let rows: Vec<usize> = found.iter().map(|row| (stream.time(*row) / recording.period).round() as usize).collect();
    let even = &mut recording.signals[place].even;
    for row in rows {
        let (from, to) = (row.saturating_sub(2), (row + 2).min(even.len().saturating_sub(1)));
        let (Some(a), Some(b)) = (even.get(from).copied(), even.get(to).copied()) else { continue };
        for i in from + 1..to {
            even[i] = a + (b - a) * (i - from) as f64 / (to - from) as f64;
        }
    }
}

/// The rows of a signal's outliers.
fn places(signal: &Signal) -> Vec<usize> {
    if !(signal.quantity.is_measured() || signal.quantity == Quantity::Command) || signal.values.len() < 50 {
        return Vec::new();
    }
    let values = &signal.values;
    let mut found: Vec<usize> = Vec::new();
    let distance = |i: usize| -> f64 {
        let mut around = [values[i - 2], values[i - 1], values[i + 1], values[i + 2]];
        around.sort_by(f64::total_cmp);
        values[i] - 0.5 * (around[1] + around[2])
    };
    let distances: Vec<f64> = (2..values.len() - 2).map(|i| distance(i).abs()).collect();
    let usual = quantile(&distances, 0.95);
    let steps: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|step| *step > 0.0).collect();
    let least = STEPS * median(&steps);
    let range = quantile(values, 0.995) - quantile(values, 0.005);
    // A sample that leaves both neighbours in the same direction, by about its whole distance.
    let stands_alone = |i: usize| {
        let (a, b, r) = (values[i] - values[i - 1], values[i] - values[i + 1], distance(i));
        a * b > 0.0 && a.abs().min(b.abs()) > 0.6 * r.abs()
    };
    let is_far = |i: usize| match signal.quantity {
        Quantity::Position | Quantity::Command => {
            let limit = (OF_POSITION[0] * 0.5 * usual).max(OF_POSITION[1] * range);
            distances[i - 2] > limit && range > 0.0
        }
        _ => distances[i - 2] > (10.0 * usual).max(BEYOND * range) && range > 0.0,
    };
    found.extend((2..values.len() - 2).filter(|i| distances[*i - 2] > least && is_far(*i) && stands_alone(*i)));
    if !matches!(signal.quantity, Quantity::Position | Quantity::Command) {
        let rest: Vec<f64> = (0..values.len()).filter(|i| !found.contains(i)).map(|i| values[i]).collect();
        let Some((low, high)) = extremes(&rest) else { return Vec::new() };
        let beyond = BEYOND * (high - low);
        found.retain(|i| values[*i] > high + beyond || values[*i] < low - beyond);
    }
    if found.len() as f64 > (FEW * values.len() as f64).max(1.0) { Vec::new() } else { found }
}

fn finding(recording: &Recording, signal: &Signal, first: usize, found: &[usize]) -> Finding {
    let values = &signal.values;
    let stream = recording.stream(signal);
    let (word, row) = (stream.row_word(), stream.row(first));
    let message = format!(
        "{:?}: {} sample{} far from {} neighbours, the first in {word} {row}: {} where the neighbours are {} and {}",
        signal.name,
        found.len(),
        if found.len() == 1 { " is" } else { "s are" },
        if found.len() == 1 { "its" } else { "their" },
        values[first],
        values[first - 1],
        values[first + 1]
    );
    let mut finding = Finding::new(FindingKind::Outliers, &recording.file, &[&signal.name], message).at(&signal.joint);
    finding.rows = Some([row, row]);
    finding.time_s = Some([stream.time(first), stream.time(first)]);
    let all: Vec<String> = found.iter().take(8).map(|i| stream.row(*i).to_string()).collect();
    let more = if found.len() > 8 { ", ..." } else { "" };
    finding.todo(format!("replace or remove {word} {}{more}: lost bus frames look like this", all.join(", ")))
}
