//! The signals of a recorded loop, one value per step: what every answer is drawn from.

use crate::outcome::{Closes, Outcome, Unit};
use crate::part_check::PartCheck;
use crate::sensors::SensorFault;
use crate::unjudged::Unjudged;

/// A recorded force-reflecting session.
///
/// All columns have the same length, one row per step. Row k of [`AxisSignals::force`] holds from k to k+1, so the first
/// position it can move is that of row k+1. A value that was not measured, or whose message is missing, is NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// For messages: the bag's path.
    pub name: String,
    /// Time of one row, s.
    pub period_s: f64,
    /// The axes, in the order of the device.
    pub axes: Vec<AxisSignals>,
    /// Position scale mu in force at each row; NaN where it was not recorded.
    pub mu: Vec<f64>,
    /// Force scale lambda in force at each row; NaN where it was not recorded.
    pub lambda: Vec<f64>,
    /// What a reader of the answers has to know: lost samples, resampled topics, gains estimated from data. One sentence each.
    pub notes: Vec<String>,
    /// Signals of the recording that say nothing, or not always, whether a role names them or not.
    pub sensors: Vec<SensorFault>,
    /// What forbids a green answer whatever the rows show: its end is missing, messages are, or it contradicts itself.
    pub cut_short: Option<Unjudged>,
    /// Devices beside their models, where the rows in contact do not decide.
    pub parts: Vec<PartCheck>,
    /// Of a recording that is longer than what is judged at once, and of which this is a piece: the worst that all of it did.
    pub elsewhere: Option<Outcome>,
    /// Longest gap that the loop bridges by holding its last force, s.
    pub bridged_s: f64,
}

/// One axis of a session.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AxisSignals {
    /// Name of the axis.
    pub name: String,
    /// x_u, the hand's intended motion, m or rad; `None` where it was not recorded.
    pub intent: Option<Vec<f64>>,
    /// x_m, the master's measured position, m or rad.
    pub master: Vec<f64>,
    /// F_f, the force applied to the master, N or N m, dither included.
    pub force: Vec<f64>,
    /// The exogenous part of F_f that was added on purpose, N or N m; `None` where there was none.
    pub dither: Option<Vec<f64>>,
    /// The predicted induced motion that was subtracted, m or rad; `None` where nothing was cancelled or it was not recorded.
    pub induced: Option<Vec<f64>>,
    /// x_c, where the slave shall be, m or rad.
    pub command: Vec<f64>,
    /// F_s, force of the environment on the slave, N or N m; 0 in free motion.
    pub contact: Vec<f64>,
    /// x_s, where the slave is, m or rad; `None` where it was not recorded.
    pub slave: Option<Vec<f64>>,
    /// tau_s, force of the slave's motor, N or N m; `None` where it was not recorded.
    pub slave_force: Option<Vec<f64>>,
    /// F_h, force of the hand on the master, N or N m; `None` where it was not recorded.
    pub hand: Option<Vec<f64>>,
    /// Whether a clamp or rate limit acted, or an input was stale.
    pub clamped: Vec<bool>,
    /// Whether an input of the master or the slave was stale, so that the loop was open; empty where it never was or this is not known.
    pub stale: Vec<bool>,
    /// The master's limits of motion, m or rad.
    pub travel: Option<[f64; 2]>,
    /// Step of the master's position sensor, m or rad; 0 for an ideal one.
    pub resolution: f64,
    /// Standard deviation of that sensor's noise, m or rad; 0 where there is none or it is not known.
    pub noise: f64,
    /// In what positions are counted.
    pub unit: Unit,
    /// What closes the loop, from the graph.
    pub closes: Closes,
}

impl Session {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.axes.first().map_or(0, |a| a.master.len())
    }

    /// Whether it holds no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether lambda is 0 throughout, so that no force comes back to the hand.
    pub fn is_one_way(&self) -> bool {
        !self.lambda.is_empty() && self.lambda.iter().all(|lambda| *lambda == 0.0)
    }

    /// mu*lambda at a row.
    pub fn gain(&self, row: usize) -> f64 {
        self.mu[row] * self.lambda[row]
    }
}
