//! Which rows of a session have information about its loop, in which state.

use crate::session::{AxisSignals, Session};
use serde::Serialize;
use std::ops::Range;

/// After a change (contact, gain, amplitude, a clamp, the hand) the loop settles for this long, s.
const SETTLE_S: f64 = 0.2;
/// Gaps of at most this many rows are bridged by a straight line.
const LONGEST_BRIDGE: usize = 4;
/// Window over which the amplitude of the dither is taken, s.
const AMPLITUDE_WINDOW_S: f64 = 0.5;
/// Amplitudes closer than this factor are one level.
const SAME_LEVEL: f64 = 1.35;

/// What became of the rows of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct RowCount {
    /// Rows of the session.
    pub all: usize,
    /// Rows that are used.
    pub used: usize,
    /// A value is missing for longer than can be bridged.
    pub missing: usize,
    /// A value was missing for a few rows only: bridged by a straight line, and used.
    pub bridged: usize,
    /// A clamp or rate limit acted, or an input was stale.
    pub clamped: usize,
    /// The gain was ramping.
    pub ramping: usize,
    /// The slave touched nothing.
    pub free: usize,
    /// How often the contact broke off.
    pub contact_losses: usize,
    /// The hand was moving.
    pub moving: usize,
    /// Nothing exogenous acted.
    pub quiet: usize,
    /// The loop was still settling after one of these.
    pub settling: usize,
}

/// What the loop is in while a row is taken: rows of one state are estimated together.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct State {
    /// Bit i: axis i touches.
    pub contact: u32,
    /// Index of the amplitude level.
    pub level: usize,
    /// Index of the gain.
    pub gain: usize,
}

/// A run of rows in one state.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stretch {
    pub state: State,
    pub rows: Range<usize>,
}

/// The usable rows of a session.
#[derive(Debug, Clone, Default)]
pub(super) struct Rows {
    pub stretches: Vec<Stretch>,
    /// (mu, lambda) of each gain index.
    pub gains: Vec<(f64, f64)>,
    /// RMS of the dither at each level, rising; unit of F_f, root of the sum over axes.
    pub levels: Vec<f64>,
    pub count: RowCount,
    /// Whether rows of a moving hand had to be used.
    pub hand_moves: bool,
}

/// Bridges short gaps of every column; returns how many rows these are, in any column.
pub(super) fn bridge(session: &mut Session) -> usize {
    let mut bridged = vec![false; session.len()];
    for axis in &mut session.axes {
        let AxisSignals { intent, master, force, dither, induced, command, contact, .. } = axis;
        let optional = [intent.as_mut(), dither.as_mut(), induced.as_mut()].into_iter().flatten();
        for column in [master, force, command, contact].into_iter().chain(optional) {
            bridge_column(column, &mut bridged);
        }
    }
    bridged.iter().filter(|b| **b).count()
}

fn bridge_column(column: &mut [f64], bridged: &mut [bool]) {
    let mut last: Option<usize> = None;
    for now in 0..column.len() {
        if !column[now].is_finite() {
            continue;
        }
        if let Some(last) = last.filter(|l| now - l > 1 && now - l - 1 <= LONGEST_BRIDGE) {
            let (from, to, length) = (column[last], column[now], (now - last) as f64);
            for i in last + 1..now {
                column[i] = from + (to - from) * (i - last) as f64 / length;
                if let Some(b) = bridged.get_mut(i) {
                    *b = true;
                }
            }
        }
        last = Some(now);
    }
}

/// The rows in which the loop is closed through a contact, excited by its dither, and without other disturbances.
pub(super) fn usable(session: &Session) -> Rows {
    let n = session.len();
    let mut rows = Rows { count: RowCount { all: n, ..RowCount::default() }, ..Rows::default() };
    let amplitude = amplitude(session);
    let (levels, level_of) = levels(&amplitude, session.period_s);
    rows.levels = levels;
    let rest = rests(session);
    let touches: Vec<u32> = (0..n).map(|row| contact(session, row)).collect();
    let known_rest = (0..n).any(|row| rest[row] && touches[row] != 0 && level_of[row].is_some());
    let knows_intent = session.axes.iter().any(|a| a.intent.is_some());
    rows.hand_moves = knows_intent && !known_rest;
    let settle = (SETTLE_S / session.period_s).round() as usize;
    // The state before the first row is not known.
    let mut settled_from = settle;
    let mut open: Option<Stretch> = None;
    for row in 0..n {
        let state = (|count: &mut RowCount, gains: &mut Vec<(f64, f64)>| {
            // A clamp, a change and a lost contact disturb the loop; a value that was not recorded does not.
            if row > 0 && touches[row] != touches[row - 1] {
                count.contact_losses += usize::from((touches[row - 1] & !touches[row]) != 0);
                settled_from = row + settle;
            }
            if !complete(session, row) {
                count.missing += 1;
                return None;
            }
            if session.axes.iter().any(|a| a.clamped.get(row).copied().unwrap_or(false)) {
                count.clamped += 1;
                settled_from = row + settle;
                return None;
            }
            if !same_gain(session, row) {
                count.ramping += 1;
                settled_from = row + settle;
                return None;
            }
            if touches[row] == 0 {
                count.free += 1;
                return None;
            }
            if known_rest && !rest[row] {
                count.moving += 1;
                settled_from = row + settle;
                return None;
            }
            let Some(level) = level_of[row] else {
                count.quiet += 1;
                settled_from = row + settle;
                return None;
            };
            if row < settled_from {
                count.settling += 1;
                return None;
            }
            let gain = gain_index(gains, (session.mu[row], session.lambda[row]));
            Some(State { contact: touches[row], level, gain })
        })(&mut rows.count, &mut rows.gains);
        rows.count.used += usize::from(state.is_some());
        match (&mut open, state) {
            (Some(stretch), Some(state)) if stretch.state == state => stretch.rows.end = row + 1,
            (_, state) => {
                rows.stretches.extend(open.take());
                open = state.map(|state| Stretch { state, rows: row..row + 1 });
            }
        }
    }
    rows.stretches.extend(open);
    rows
}

fn complete(session: &Session, row: usize) -> bool {
    session.axes.iter().all(|a| {
        let needed = [&a.master, &a.force, &a.command, &a.contact].into_iter().chain(&a.dither);
        needed.into_iter().all(|c| c.get(row).is_some_and(|x| x.is_finite()))
    })
}

/// Bit i: axis i touches. A row whose contact force is missing counts as the one before it would.
fn contact(session: &Session, row: usize) -> u32 {
    let mut mask = 0;
    for (i, axis) in session.axes.iter().enumerate().take(32) {
        let last = axis.contact[..=row.min(axis.contact.len().saturating_sub(1))].iter().rev().take(1000).find(|x| x.is_finite());
        mask |= u32::from(last.is_some_and(|f| *f != 0.0)) << i;
    }
    mask
}

fn same_gain(session: &Session, row: usize) -> bool {
    let same = |column: &[f64]| match (row.checked_sub(1).and_then(|r| column.get(r)), column.get(row)) {
        (Some(before), Some(now)) => (now - before).abs() <= 1e-9 * now.abs() || (now.is_nan() && before.is_nan()),
        _ => true,
    };
    same(&session.mu) && same(&session.lambda)
}

fn gain_index(gains: &mut Vec<(f64, f64)>, now: (f64, f64)) -> usize {
    let same = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b.abs() || (a.is_nan() && b.is_nan());
    gains.iter().position(|g| same(g.0, now.0) && same(g.1, now.1)).unwrap_or_else(|| {
        gains.push(now);
        gains.len() - 1
    })
}

/// Whether every hand whose intent is known stands still.
fn rests(session: &Session) -> Vec<bool> {
    let mut rest = vec![true; session.len()];
    for intent in session.axes.iter().filter_map(|a| a.intent.as_ref()) {
        for row in 0..rest.len().min(intent.len()) {
            rest[row] &= row == 0 || intent[row] == intent[row - 1] || intent[row].is_nan();
        }
    }
    rest
}

/// RMS of the dither of all axes about each row.
fn amplitude(session: &Session) -> Vec<f64> {
    let n = session.len();
    let mut energy = vec![0.0; n + 1];
    for row in 0..n {
        let square = |a: &AxisSignals| a.dither.as_ref().and_then(|d| d.get(row)).filter(|x| x.is_finite()).map_or(0.0, |x| x * x);
        energy[row + 1] = energy[row] + session.axes.iter().map(square).sum::<f64>();
    }
    let half = ((0.5 * AMPLITUDE_WINDOW_S / session.period_s).round() as usize).clamp(1, n.max(1));
    (0..n)
        .map(|row| {
            let (from, to) = (row.saturating_sub(half), (row + half).min(n));
            (energy[to] - energy[from]).max(0.0).sqrt() / ((to - from).max(1) as f64).sqrt()
        })
        .collect()
}

/// The distinct amplitudes, and to which each row belongs; none where it is quiet or on the way from one to another.
fn levels(amplitude: &[f64], period_s: f64) -> (Vec<f64>, Vec<Option<usize>>) {
    let n = amplitude.len();
    let largest = amplitude.iter().copied().fold(0.0, f64::max);
    if largest <= 0.0 {
        return (Vec::new(), vec![None; n]);
    }
    let half = ((0.5 * AMPLITUDE_WINDOW_S / period_s).round() as usize).max(1);
    // Rows whose amplitude is that of half a window before and after.
    let settled = |row: usize| {
        let about = [row.saturating_sub(half), (row + half).min(n - 1)].map(|i| amplitude[i]);
        let now = amplitude[row];
        now > 0.005 * largest && about.iter().all(|a| *a < SAME_LEVEL * now && now < SAME_LEVEL * a)
    };
    let settled: Vec<bool> = (0..n).map(settled).collect();
    let mut sorted: Vec<f64> = (0..n).filter(|row| settled[*row]).map(|row| amplitude[row]).collect();
    sorted.sort_by(f64::total_cmp);
    let mut groups: Vec<(f64, f64, usize)> = Vec::new();
    for a in sorted {
        match groups.last_mut() {
            // A group goes on for as long as it has no gap, and does not creep beyond what noise of the estimate makes.
            Some((_, high, count)) if a < 1.08 * *high => (*high, *count) = (a, *count + 1),
            _ => groups.push((a, a, 1)),
        }
    }
    // Groups that noise has torn apart belong together.
    let mut joined: Vec<(f64, f64, usize)> = Vec::new();
    for (low, high, count) in groups {
        match joined.last_mut() {
            Some(before) if low < SAME_LEVEL * before.1 => (before.1, before.2) = (high, before.2 + count),
            _ => joined.push((low, high, count)),
        }
    }
    let least = (AMPLITUDE_WINDOW_S / period_s) as usize;
    joined.retain(|g| g.2 >= least);
    let several = joined.len() > 1;
    let level_of = (0..n)
        .map(|row| {
            let a = amplitude[row];
            // Of one level only, every row with dither counts.
            let counts = if several { settled[row] } else { a > 0.3 * joined.first().map_or(f64::INFINITY, |g| g.0) };
            let level = joined.iter().position(|g| !several || (a >= 0.99 * g.0 && a <= 1.01 * g.1))?;
            counts.then_some(level)
        })
        .collect::<Vec<_>>();
    let rms = |level: usize| {
        let members: Vec<f64> = (0..n).filter(|row| level_of[*row] == Some(level)).map(|row| amplitude[row]).collect();
        members.iter().sum::<f64>() / members.len().max(1) as f64
    };
    ((0..joined.len()).map(rms).collect(), level_of)
}
