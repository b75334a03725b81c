//! The answer over a range of grips: how firm the hand is is not known exactly.

use super::edge::{Edge, Search, edge};
use super::{ResimulateError, RunOptions, Scenario};
use crate::outcome::Outcome;
use crate::resimulate::grip::grip;
use std::sync::atomic::AtomicBool;

/// The grips over which an answer is given: factors on the stiffness and damping of the master's grip.
pub const SCALES: [f64; 5] = [0.7, 0.85, 1.0, 1.15, 1.3];

/// The stability limit with one grip.
#[derive(Debug, Clone)]
pub struct GripEdge {
    /// Factor on the grip's stiffness and damping.
    pub scale: f64,
    /// Its stability limit.
    pub edge: Edge,
    /// The verdict at the gain asked, where one was.
    pub at_asked: Option<Outcome>,
}

/// The stability limit for every grip; empty for a master that no grip holds. `done` hears (runs done, about how many there will be).
///
/// # Errors
/// A run that cannot be done; `cancel` was set.
pub fn grips(
    scenario: &Scenario,
    scales: &[f64],
    asked: Option<f64>,
    search: &Search,
    options: &RunOptions,
    done: &(dyn Fn(usize, usize) + Sync),
    cancel: &AtomicBool,
) -> Result<Vec<GripEdge>, ResimulateError> {
    if grip(scenario.graph()).is_none() {
        return Ok(Vec::new());
    }
    let mut answers = Vec::new();
    for (index, scale) in scales.iter().enumerate() {
        let options = RunOptions { grip_scale: *scale, keep_signals: false, ..*options };
        let tell = |n: usize, of: usize| done(index * of + n, scales.len() * of);
        // Gains above the limit are examined for the nominal grip, not for each of these.
        let search = Search { whole_grid: false, ..*search };
        let edge = edge(scenario, &search, &options, &tell, cancel)?;
        let at_asked = asked.map(|gain| scenario.run(scenario.gain(gain), &options, cancel)).transpose()?;
        answers.push(GripEdge { scale: *scale, edge, at_asked: at_asked.map(|run| run.outcome) });
    }
    Ok(answers)
}
