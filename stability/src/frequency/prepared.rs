//! A session made ready: gains that were not recorded, the columns of all axes, and what to record with.

use super::FrequencyError;
use super::note::Note;
use super::rows::Rows;
use crate::session::Session;

/// The dither that is advised where nothing better is known.
const DEFAULT_DITHER: &str = "multisine:peak=0.05,from=1,to=500,period=2";

/// The columns of an axis, in the order in which they are put before the transforms.
#[derive(Debug, Clone, Copy)]
pub(super) enum Column {
    Dither,
    Force,
    /// Reflected force per unit gain.
    Reflected,
    Master,
    /// Command over mu.
    Motion,
    Command,
    Contact,
    /// What was cancelled.
    Induced,
}

const COLUMNS: usize = 8;

pub(super) fn column(axis: usize, column: Column) -> usize {
    axis * COLUMNS + column as usize
}

pub(super) fn columns(axes: usize, which: Column) -> Vec<usize> {
    (0..axes).map(|axis| column(axis, which)).collect()
}

/// A session with what is derived from it.
pub(super) struct Prepared {
    pub session: Session,
    pub signals: Vec<Vec<f64>>,
    pub rows: Rows,
}

pub(super) fn check_shape(session: &Session) -> Result<(), FrequencyError> {
    let n = session.len();
    let same = |a: &crate::session::AxisSignals| {
        let optional = [&a.intent, &a.dither, &a.induced].into_iter().flatten();
        [&a.master, &a.force, &a.command, &a.contact].into_iter().chain(optional).all(|c| c.len() == n)
    };
    let good = n > 0 && session.period_s > 0.0 && session.mu.len() == n && session.lambda.len() == n && session.axes.iter().all(same);
    good.then_some(()).ok_or_else(|| FrequencyError::Shape(session.name.clone()))
}

/// Fills in gains that were not recorded, from the signals; returns whether they stay unknown.
pub(super) fn complete_gains(session: &mut Session, notes: &mut Vec<Note>) -> bool {
    let missing = |column: &[f64]| column.iter().all(|x| !x.is_finite());
    let n = session.len();
    if missing(&session.lambda) {
        let Some((lambda, lag)) = proportional(session, |a, row| a.contact[row], |a, row| a.force[row] - dither(a, row)) else {
            return unknown_gains(session, notes);
        };
        notes.push(Note::LambdaFromSignals { lambda, lag });
        session.lambda = vec![lambda; n];
    }
    if missing(&session.mu) {
        let moved = |a: &crate::session::AxisSignals, row: usize| a.master[row] - a.induced.as_ref().map_or(0.0, |i| i[row]);
        let Some((mu, lag)) = proportional(session, moved, |a, row| a.command[row]) else { return unknown_gains(session, notes) };
        notes.push(Note::MuFromSignals { mu, lag });
        session.mu = vec![mu; n];
    }
    false
}

fn unknown_gains(session: &mut Session, notes: &mut Vec<Note>) -> bool {
    notes.push(Note::GainsUnknown);
    (session.mu, session.lambda) = (vec![1.0; session.len()], vec![1.0; session.len()]);
    true
}

fn dither(axis: &crate::session::AxisSignals, row: usize) -> f64 {
    axis.dither.as_ref().map_or(0.0, |d| d[row])
}

/// Factor and lag, rows, of one signal on another by least squares; `None` where it explains less than 99.8 %.
fn proportional(
    session: &Session,
    from: impl Fn(&crate::session::AxisSignals, usize) -> f64,
    to: impl Fn(&crate::session::AxisSignals, usize) -> f64,
) -> Option<(f64, usize)> {
    let mut best: Option<(f64, f64, usize)> = None;
    for lag in 0..=((0.02 / session.period_s) as usize).min(200) {
        let (mut n, mut sx, mut sy, mut sxx, mut sxy, mut syy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for axis in &session.axes {
            for row in lag..session.len() {
                let (x, y) = (from(axis, row - lag), to(axis, row));
                // Rows without contact say nothing.
                if x.is_finite() && y.is_finite() && x != 0.0 && axis.contact[row] != 0.0 {
                    (n, sx, sy) = (n + 1.0, sx + x, sy + y);
                    (sxx, sxy, syy) = (sxx + x * x, sxy + x * y, syy + y * y);
                }
            }
        }
        // With a constant: somebody else's frames need not have their zeros in one place.
        let (xx, xy, yy) = (sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n);
        if xx > 0.0 && yy > 0.0 {
            let explained = xy * xy / (xx * yy);
            if best.is_none_or(|b| explained > b.0) {
                best = Some((explained, xy / xx, lag));
            }
        }
    }
    best.filter(|b| b.0 > 0.998 && b.1 > 0.0).map(|b| (b.1, b.2))
}

/// Rows whose gain is not known go where other rows have theirs.
pub(super) fn drop_unknown_gains(rows: &mut Rows) {
    let known = |gain: &(f64, f64)| gain.0.is_finite() && gain.1.is_finite() && gain.0 * gain.1 != 0.0;
    let good: Vec<bool> = rows.gains.iter().map(known).collect();
    rows.stretches.retain(|s| good.get(s.state.gain).copied().unwrap_or(false));
    rows.count.used = rows.stretches.iter().map(|s| s.rows.len()).sum();
}

/// The columns of all axes, gains divided out.
pub(super) fn signals(session: &Session, induced: Option<&[Vec<f64>]>) -> Vec<Vec<f64>> {
    let n = session.len();
    let per = |x: f64, gain: f64| if gain != 0.0 && gain.is_finite() { x / gain } else { f64::NAN };
    let mut all = Vec::new();
    for (i, axis) in session.axes.iter().enumerate() {
        let d: Vec<f64> = (0..n).map(|row| dither(axis, row)).collect();
        let reflected = (0..n).map(|row| per(axis.force[row] - d[row], session.gain(row))).collect();
        let motion: Vec<f64> = match induced.and_then(|columns| columns.get(i)) {
            Some(other) => (0..n).map(|row| axis.master[row] - other[row]).collect(),
            None => (0..n).map(|row| per(axis.command[row], session.mu[row])).collect(),
        };
        let cancelled = (0..n).map(|row| axis.master[row] - motion[row]).collect();
        // In the order of `Column`.
        all.extend([d, axis.force.clone(), reflected, axis.master.clone(), motion, axis.command.clone(), axis.contact.clone(), cancelled]);
    }
    all
}

/// A dither to record with: about a tenth of the reflected force, at least the default.
pub(super) fn advice(session: &Session) -> String {
    let (mut sum, mut count) = (0.0, 0_usize);
    for axis in &session.axes {
        for row in 0..session.len() {
            let reflected = axis.force[row] - dither(axis, row);
            if axis.contact[row] != 0.0 && reflected.is_finite() {
                (sum, count) = (sum + reflected * reflected, count + 1);
            }
        }
    }
    let rms = (sum / count.max(1) as f64).sqrt();
    let text = if rms > 0.5 { format!("multisine:peak={:.2},from=1,to=500,period=2", 0.1 * rms) } else { DEFAULT_DITHER.to_string() };
    format!("record again with --dither {text}, with the hand pressing and at rest for 10 s")
}
