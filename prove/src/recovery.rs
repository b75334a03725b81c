//! How soon a loop settles after its hand has changed its grip.

use super::edges::{Canceller, Loop};
use crate::error::ProveError;
use backdrive_nodes::graph::{NodeKind, Settings};
use backdrive_signal::statistics::median;
use backdrive_stability::resimulate::RunOptions;
use std::sync::atomic::AtomicBool;

/// The force counts as settled where it stays within this share of how far it went after the change.
const WITHIN: f64 = 0.05;
/// What a force does below this is no motion of the loop, N or N m.
const LEAST_FORCE: f64 = 0.02;
/// What is looked at after the hand has changed its grip, s.
const AFTER_S: f64 = 1.2;

/// Settling time after a change of the grip, s, at the gain `gain` (mu*lambda): the median over the changes. It ends when the force of what the slave
/// touches has settled, and includes the hand's own move that begins with a change. `None` where nothing changes or the loop runs away.
///
/// # Errors
/// A run that cannot be done.
pub fn recovery(the_loop: &Loop, canceller: &Canceller, gain: f64, cancel: &AtomicBool) -> Result<Option<f64>, ProveError> {
    let scenario = the_loop.scenario(canceller, 1.0)?;
    let options = RunOptions { keep_signals: true, ..RunOptions::default() };
    let run = scenario.run(scenario.gain(gain), &options, cancel).map_err(ProveError::input)?;
    let changes = match scenario.graph().node_of(NodeKind::Master).map(|n| &n.settings) {
        Some(Settings::Master(files)) => files.grip_changes.clone(),
        _ => Vec::new(),
    };
    let Some(signals) = run.signals else { return Ok(None) };
    let settle = |at_s: f64| {
        let of = |seconds: f64| (seconds / signals.period_s).round() as usize;
        signals
            .axes
            .iter()
            .map(|axis| Some(settled(axis.contact.get(of(at_s)..of(at_s + AFTER_S))?)? as f64 * signals.period_s))
            .try_fold(0.0_f64, |most, time| Some(most.max(time?)))
    };
    Ok(median(changes.iter().filter_map(|change| settle(change.at_s)).collect()))
}

/// Samples after which a signal stays near its end.
fn settled(signal: &[f64]) -> Option<usize> {
    let tail = signal.get(signal.len() - signal.len() / 10..).filter(|tail| !tail.is_empty())?;
    let end = tail.iter().sum::<f64>() / tail.len() as f64;
    let farthest = signal.iter().map(|x| (x - end).abs()).fold(0.0, f64::max);
    if !farthest.is_finite() {
        return None;
    }
    let near = (WITHIN * farthest).max(LEAST_FORCE);
    Some(signal.iter().rposition(|x| (x - end).abs() > near).map_or(0, |last| last + 1))
}

#[cfg(test)]
mod tests {
    use super::settled;

    #[test]
    fn a_signal_has_settled_where_it_stays_near_its_end() {
        let signal: Vec<f64> = (0..1000).map(|i| 3.0 - 2.0 * (-f64::from(i) / 50.0).exp()).collect();
        // 2 exp(-t) is 5 per cent of 2 at t = ln 20 = 3.0 times 50 samples.
        assert_eq!(settled(&signal), Some(150));
        assert_eq!(settled(&[1.0; 100]), Some(0));
        assert_eq!(settled(&[]), None);
    }
}
