//! Whether nothing oscillates in a run that was re-simulated.

use crate::change::Change;
use crate::trial::{Hand, Trial};
use backdrive_stability::outcome::Outcome;
use backdrive_stability::resimulate::{Gain, ResimulateError, Run, RunOptions};
use std::sync::atomic::AtomicBool;

/// Whether nothing oscillates: a limit may act, where nothing would happen without it.
///
/// # Errors
/// As a run.
pub fn is_fine(trial: &Trial, hand: &Hand, gain: Gain, run: &Run, cancel: &AtomicBool) -> Result<bool, ResimulateError> {
    if !matches!(run.outcome, Outcome::Limited { beyond_travel: false, .. }) {
        return Ok(run.outcome.is_stable());
    }
    let mut unlimited = trial.clone();
    Change::NoLimits.apply(&mut unlimited);
    Ok(unlimited.run(hand, gain, &RunOptions::default(), cancel)?.outcome.is_stable())
}
