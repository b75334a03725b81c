//! What a rival is like at one gain: what the hand feels, how well the slave follows, what it costs.

use crate::outcome::Outcome;
use crate::phases::{contacts, holds};
use crate::session::{AxisSignals, Session};
use backdrive_signal::statistics::rms_of_finite;
use serde::Serialize;

/// Half the time over which a velocity is computed from positions, s.
const VELOCITY_S: f64 = 0.005;

/// A master that has moved into the wall by less than this gives no measurable stiffness, m or rad.
const LEAST_DEPTH: f64 = 10e-6;

/// Numbers of a run, of the axis that touches hardest. `None` where it cannot be determined: no contact, no hold, no rest.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Measures {
    /// Stiffness that the hand is shown while it holds still in contact over mu*lambda times that of the wall, no unit; 1 is transparent. `None`
    /// where the master rests before the wall's surface, as behind a canceller, which lets the slave go where the hand would have it.
    pub stiffness_share: Option<f64>,
    /// Drag in free motion before the first contact: force against the motion per velocity, N s/m or N m s/rad at the master; 0 is
    /// transparent.
    pub drag: Option<f64>,
    /// x_s - mu x_m, root mean square before the first contact, m or rad.
    pub tracking_free: Option<f64>,
    /// The same in contact.
    pub tracking_contact: Option<f64>,
    /// Force on the master in contact, root mean square, N or N m.
    pub effort: Option<f64>,
    /// Largest force on the master, N or N m.
    pub effort_peak: Option<f64>,
    /// Largest force of the environment on the slave, N or N m.
    pub contact_peak: Option<f64>,
}

impl Measures {
    /// Of a run with its verdict: no stiffness is reported for one that does not come to rest.
    pub fn of(session: &Session, outcome: &Outcome) -> Measures {
        let rows = 0..session.len();
        let size = |axis: &AxisSignals| rms_of_finite(rows.clone().map(|row| at(&axis.contact, row))).unwrap_or(0.0);
        let Some(axis) = session.axes.iter().max_by(|a, b| size(a).total_cmp(&size(b))) else { return Measures::default() };
        let tip = axis.slave.as_ref().unwrap_or(&axis.command);
        let pieces = contacts(axis, session.period_s);
        let first = pieces.first().map_or(session.len(), |piece| piece.start);
        let touching = || pieces.iter().flat_map(Clone::clone);
        let apart = |row: usize| at(tip, row) - at(&session.mu, row) * at(&axis.master, row);
        let largest = |column: &[f64]| column.iter().filter(|f| f.is_finite()).map(|f| f.abs()).reduce(f64::max);
        Measures {
            stiffness_share: if outcome.is_stable() { stiffness_share(session, axis, tip, first) } else { None },
            drag: drag(axis, first, session.period_s),
            tracking_free: rms_of_finite((0..first).map(apart)),
            tracking_contact: rms_of_finite(touching().map(apart)),
            effort: rms_of_finite(touching().map(|row| at(&axis.force, row))),
            effort_peak: largest(&axis.force),
            contact_peak: largest(&axis.contact),
        }
    }
}

fn at(column: &[f64], row: usize) -> f64 {
    column.get(row).copied().unwrap_or(f64::NAN)
}

/// Means over the last quarter of the longest hold: force over depth at the master, over the same at the slave.
fn stiffness_share(session: &Session, axis: &AxisSignals, tip: &[f64], first: usize) -> Option<f64> {
    let hold = holds(axis, session.period_s).into_iter().max_by_key(|hold| hold.len())?;
    let rest = hold.end - hold.len().div_ceil(4)..hold.end;
    let mean = |column: &[f64]| {
        let known = rest.clone().map(|row| at(column, row)).filter(|v| v.is_finite());
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
        (count > 0.0).then(|| sum / count)
    };
    let (mu, lambda) = (mean(&session.mu)?, mean(&session.lambda)?);
    let surface = at(tip, first);
    let depth = mean(&axis.master)? - surface / mu;
    let wall = mean(&axis.contact)? / (mean(tip)? - surface);
    let shown = mean(&axis.force)? / depth;
    let share = shown / (mu * lambda * wall);
    // Behind a canceller the master rests before the surface while the slave is in the wall: then it is shown none.
    (depth.abs() > LEAST_DEPTH && share > 0.0).then_some(share)
}

/// Least squares of -F_f over the master's velocity before the first contact.
fn drag(axis: &AxisSignals, first: usize, period_s: f64) -> Option<f64> {
    let n = ((VELOCITY_S / period_s) as usize).max(1);
    let (mut power, mut square) = (0.0, 0.0);
    for row in n..first.min(axis.master.len()).saturating_sub(n) {
        let velocity = (at(&axis.master, row + n) - at(&axis.master, row - n)) / (2.0 * n as f64 * period_s);
        let force = at(&axis.force, row);
        if velocity.is_finite() && force.is_finite() {
            (power, square) = (power - force * velocity, square + velocity * velocity);
        }
    }
    (square > 0.0).then(|| power / square)
}
