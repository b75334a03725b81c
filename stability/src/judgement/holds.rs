//! Where a run can be judged: the hand holds still, the loop is closed, and no sample is missing.

use crate::outcome::{Closes, Trace};

/// The first part of a hold is the transient of getting there, s.
pub(super) const TRANSIENT_S: f64 = 0.15;
/// A hold must last this long beyond its transient to be judged, s.
pub(super) const LEAST_HOLD_S: f64 = 0.3;
/// And hold this many samples: each of its quarters then has more than one period of an oscillation at a third of the rate.
const LEAST_SAMPLES: usize = 16;

/// A loop that bounces off what it touches touches it again within this, s.
const BRIDGED_S: f64 = 0.05;

/// Where the hand's intent was not recorded, it counts as holding on while the slave is in contact; pieces of rows, short losses of contact bridged.
fn in_contact(trace: &Trace, rows: usize) -> Vec<bool> {
    let bridged = (BRIDGED_S / trace.period_s) as usize;
    let mut held = vec![trace.closes == Closes::Always; rows];
    let mut before: Option<usize> = None;
    for row in (0..rows).filter(|row| trace.contact[*row] != 0.0) {
        let from = before.filter(|b| row - b <= bridged).unwrap_or(row);
        held[from..=row].fill(true);
        before = Some(row);
    }
    held
}

/// Pieces in which the hand holds still, the loop is closed at least now and then, and no sample is missing for longer than the loop
/// bridges; transients cut off.
pub(super) fn holds(trace: &Trace) -> Vec<(usize, usize)> {
    let n = trace.position.len().min(trace.contact.len());
    let mut open = vec![false; n];
    for gap in trace.gaps.long(trace.period_s) {
        open[gap.start.min(n)..gap.end.min(n)].fill(true);
    }
    let touching = trace.intent.is_empty().then(|| in_contact(trace, n));
    let still = |i: usize| !open[i] && touching.as_ref().map_or_else(|| hand_still(trace, i), |held| held[i]);
    let (transient, least) = ((TRANSIENT_S / trace.period_s) as usize, ((LEAST_HOLD_S / trace.period_s) as usize).max(LEAST_SAMPLES));
    let mut holds = Vec::new();
    let mut start = None;
    for i in 0..=n {
        match (i < n && still(i), start) {
            (true, None) => start = Some(i),
            (false, Some(from)) => {
                let from = from + transient;
                let closed = from < i && (trace.closes == Closes::Always || trace.contact[from..i].iter().any(|f| *f != 0.0));
                if closed && i - from >= least {
                    holds.push((from, i));
                }
                start = None;
            }
            _ => {}
        }
    }
    holds
}

fn hand_still(trace: &Trace, i: usize) -> bool {
    i == 0 || i >= trace.intent.len() || trace.intent[i] == trace.intent[i - 1]
}
