//! The gain raised with every canceller and hand, the hidden plant being the master.

use super::edges::{Canceller, Loop, Moved};
use super::files::at;
use super::gain::{ESTIMATED, Gain, Hand};
use super::hidden::{Hidden, Opened};
use super::live::{self, LiveRun};
use super::recovery::recovery;
use crate::error::ProveError;
use crate::options::Options;
use crate::watch::{Watch, busy};
use backdrive_sealed::truth::Truth;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Cancellers that are compared with other hands than the session's.
const WITH_OTHER_HANDS: [&str; 6] = ["none", "second order", "linear, refitted", "diagnosed", "chosen", ESTIMATED];

/// Cancellers whose critical gains the live graph confirms.
const LIVE: [&str; 4] = ["none", "diagnosed", "chosen", ESTIMATED];

/// Share of its stable gain at which it is looked how soon the loop settles after a change of the grip.
const RECOVERS_AT: f64 = 0.5;

/// What the gain was raised to.
pub struct Raised {
    /// By canceller and hand.
    pub gains: Vec<Gain>,
    /// The live graph about some of the critical gains.
    pub live: Vec<LiveRun>,
    /// Median time to settle after a change of the grip with the hand estimated, s.
    pub recovery_s: Option<f64>,
}

/// Raises the gain with every canceller and hand, the hidden plant being the master; runs the live graph about some of the critical gains.
///
/// # Errors
/// A file that cannot be read or written, or a run that cannot be done.
pub fn raise(
    options: &Options,
    folder: &Path,
    hidden: &Hidden,
    truth: &Truth,
    cancellers: &[Canceller],
    watch: &dyn Watch,
) -> Result<Raised, ProveError> {
    let device = Arc::new(Opened::new(hidden, truth).map_err(ProveError::input)?);
    let master = || Moved::Hidden(&hidden.model, hidden.grip.as_deref(), device.clone());
    let steady = Loop { graph: &options.contact, high_pass_hz: options.high_pass_hz, master: master() };
    let changing = Loop { graph: &options.regrip, high_pass_hz: options.high_pass_hz, master: master() };
    let mut hands = vec![Hand::SESSION];
    if let Some(grips) = &options.grips {
        hands.extend(grips.iter().map(|grip| Hand::Grip(*grip)).chain([Hand::Changing]));
    }
    let stop = watch.stop();
    let mut raised = Raised { gains: Vec::new(), live: Vec::new(), recovery_s: None };
    for hand in hands {
        let (the_loop, firmness) = match hand {
            Hand::Grip(factor) => (&steady, factor),
            Hand::Changing => (&changing, 1.0),
        };
        for canceller in cancellers.iter().filter(|c| hand == Hand::SESSION || WITH_OTHER_HANDS.contains(&c.name)) {
            if stop.load(Ordering::SeqCst) {
                break;
            }
            let raising = at(folder, &format!("raising the gain with canceller \"{}\", {hand}", canceller.name));
            let edge = busy(watch, &raising, || the_loop.edge(canceller, firmness, stop))?;
            if hand == Hand::SESSION && options.live && LIVE.contains(&canceller.name) {
                let live_folder = folder.join("live");
                let about = || live::about(&options.backdrive, &live_folder, the_loop, canceller, &edge, hidden, &device);
                raised.live.extend(busy(watch, &at(folder, "running the live graph"), about)?);
            }
            if hand == Hand::Changing && canceller.estimates_hand {
                let settle = || recovery(the_loop, canceller, RECOVERS_AT * edge.at_least, stop);
                raised.recovery_s = busy(watch, &at(folder, "measuring the settling time after a change of the grip"), settle)?;
            }
            let whole_range = edge.critical_gain.is_none() && edge.limited_from.is_none() && edge.at_least > 0.0;
            raised.gains.push(Gain { canceller: canceller.name, hand, stable_to: edge.at_least, because: edge.reason, whole_range });
        }
    }
    Ok(raised)
}
