//! Free motion, contact and hold of a session: which rows an answer may be drawn from.

use crate::session::AxisSignals;
use std::ops::Range;

/// A slave that leaves contact for less than this stays in contact, s.
const BRIDGE_S: f64 = 0.05;
/// The first part of a hold is the transient of getting there, s.
const TRANSIENT_S: f64 = 0.15;
/// A hold lasts at least this long beyond its transient, s.
const LEAST_HOLD_S: f64 = 0.3;
/// Without an intent the hand counts as holding still while the mean of the master's position over [`SLOW_S`] moves by less than
/// this share of its range in a second.
const STILL_SHARE_PER_S: f64 = 0.1;
/// One period of the slowest oscillation that counts as one, s.
const SLOW_S: f64 = 0.125;
/// Below this share of its peak a force that is never exactly 0 (a real sensor's) counts as none.
const FORCE_SHARE: f64 = 0.03;

/// Rows of an axis in contact, as pieces; shorter gaps than 50 ms are bridged.
pub(crate) fn contacts(axis: &AxisSignals, period_s: f64) -> Vec<Range<usize>> {
    let least = least_force(&axis.contact);
    let bridge = (BRIDGE_S / period_s) as usize;
    let mut pieces: Vec<Range<usize>> = Vec::new();
    for (row, force) in axis.contact.iter().enumerate() {
        if force.abs() <= least || force.is_nan() {
            continue;
        }
        match pieces.last_mut() {
            Some(last) if row - last.end <= bridge => last.end = row + 1,
            _ => pieces.push(row..row + 1),
        }
    }
    pieces
}

/// Up to which magnitude a force is none: 0 where it is exactly 0 at times, else a share of its peak.
fn least_force(force: &[f64]) -> f64 {
    let (mut known, mut zeros, mut peak) = (0_usize, 0_usize, 0.0_f64);
    for f in force.iter().filter(|f| f.is_finite()) {
        known += 1;
        zeros += usize::from(*f == 0.0);
        peak = peak.max(f.abs());
    }
    if zeros * 100 >= known { 0.0 } else { FORCE_SHARE * peak }
}

/// Pieces of contact in which the hand holds still, without their transients.
pub(crate) fn holds(axis: &AxisSignals, period_s: f64) -> Vec<Range<usize>> {
    let still = still(axis, period_s);
    let (transient, least) = ((TRANSIENT_S / period_s) as usize, (LEAST_HOLD_S / period_s) as usize);
    let mut holds = Vec::new();
    for contact in contacts(axis, period_s) {
        let mut start = None;
        for row in contact.start..=contact.end {
            let rests = row < contact.end && still.get(row).copied().unwrap_or(false);
            match (rests, start) {
                (true, None) => start = Some(row),
                (false, Some(from)) => {
                    let from: usize = from + transient;
                    if from + least <= row {
                        holds.push(from..row);
                    }
                    start = None;
                }
                _ => {}
            }
        }
    }
    holds
}

fn still(axis: &AxisSignals, period_s: f64) -> Vec<bool> {
    if let Some(intent) = &axis.intent {
        // A lost sample of the hand does not mean that it moved.
        let mut before = f64::NAN;
        return intent
            .iter()
            .map(|x| {
                let same = x.is_nan() || before.is_nan() || *x == before;
                before = if x.is_nan() { before } else { *x };
                same
            })
            .collect();
    }
    let n = axis.master.len();
    let half = ((0.5 * SLOW_S / period_s).round() as usize).max(1);
    let mut sums = Vec::with_capacity(n + 1);
    let (mut sum, mut count) = (0.0, 0_usize);
    sums.push((sum, count));
    for x in &axis.master {
        if x.is_finite() {
            sum += x;
            count += 1;
        }
        sums.push((sum, count));
    }
    let mean = |from: usize, to: usize| match (sums.get(from), sums.get(to)) {
        (Some(a), Some(b)) if b.1 > a.1 => (b.0 - a.0) / (b.1 - a.1) as f64,
        _ => f64::NAN,
    };
    let (low, high) =
        axis.master.iter().filter(|x| x.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let most = STILL_SHARE_PER_S * (high - low);
    let speed = |row: usize| {
        let (from, to) = (row.saturating_sub(half), (row + half).min(n));
        let time = 0.5 * (to - from) as f64 * period_s;
        (mean(row, to) - mean(from, row)) / time
    };
    (0..n).map(|row| speed(row).abs() <= most).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(intent: bool) -> AxisSignals {
        let x = |t: f64| if t < 1.0 { 0.01 * t } else { 0.01 };
        let times = || (0..3000).map(|i| i as f64 * 1e-3);
        AxisSignals {
            intent: intent.then(|| times().map(x).collect()),
            master: times().map(|t| x(t) + 1e-5 * (300.0 * t).sin()).collect(),
            contact: times().map(|t| if (0.5..2.5).contains(&t) { -2.0 } else { 0.0 }).collect(),
            ..AxisSignals::default()
        }
    }

    #[test]
    fn contact_and_hold_are_found_with_and_without_an_intent() {
        assert_eq!(contacts(&axis(true), 1e-3), vec![500..2500; 1]);
        let (with, without) = (holds(&axis(true), 1e-3), holds(&axis(false), 1e-3));
        assert_eq!((with.len(), without.len()), (1, 1));
        assert!((1140..1160).contains(&with[0].start) && with[0].end == 2500, "{with:?}");
        assert!((1140..1250).contains(&without[0].start) && without[0].end == 2500, "{without:?}");
    }

    #[test]
    fn a_force_that_is_never_zero_has_a_threshold() {
        let mut noisy = axis(true);
        noisy.contact.iter_mut().enumerate().for_each(|(i, f)| *f += 0.01 * ((i % 7) as f64 - 2.9));
        assert_eq!(contacts(&noisy, 1e-3), vec![500..2500; 1]);
    }
}
