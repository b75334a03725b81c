//! What may be asked of a diagnosis: the same options for one axis, an arm and servo joints.

use crate::output_error::work::{Limit, Steps};
use crate::tuning::tuning;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Effects that may be missing at once in a device of one axis, where nothing else is asked.
pub const EFFECTS: usize = 3;

/// How to search. What is `None` has the default of the kind of device.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Effects that are withheld, by name, and with them all that contain one.
    pub without: Vec<String>,
    /// Effects at once, at most.
    pub effects: Option<usize>,
    /// Work of the search, as a multiple of the default. The verdict depends on this, and not on the speed or load of a machine. Only of one axis.
    pub effort: Option<f64>,
    /// Limit on the wall-clock time of the search. What it cuts off may differ from machine to machine, so a verdict reports where it did.
    pub patience: Option<Duration>,
    /// Corner of the filter of a regression, Hz, where the motion shall not determine it. Only of an arm.
    pub corner_hz: Option<f64>,
}

impl Options {
    /// The wall-clock limit of a search of one axis where nothing else is asked.
    pub fn usual_patience() -> Duration {
        Duration::from_secs(tuning().search.patience)
    }

    /// Effects at once of a device of one axis, at most.
    pub fn effects_of_one_axis(&self) -> usize {
        self.effects.unwrap_or(EFFECTS)
    }

    /// Work that a search of one axis may do.
    pub fn work(&self) -> Steps {
        (self.effort.unwrap_or(1.0).max(0.0) * tuning().search.work as f64) as Steps
    }

    /// What ends a search of one axis that begins now from outside.
    pub fn limit<'a>(&self, stop: Option<&'a AtomicBool>) -> Limit<'a> {
        Limit { stop, deadline: Instant::now().checked_add(self.patience.unwrap_or_else(Options::usual_patience)) }
    }

    /// What ends a search from outside that ends by itself otherwise: that of an arm, or of servo joints. There is a deadline only where one is asked.
    pub fn limit_as_asked<'a>(&self, stop: Option<&'a AtomicBool>) -> Limit<'a> {
        Limit { stop, deadline: self.patience.and_then(|patience| Instant::now().checked_add(patience)) }
    }

    /// About how long a search of one axis takes on two threads of a laptop, for progress bars.
    pub fn expected(&self) -> Duration {
        let patience = self.patience.unwrap_or_else(Options::usual_patience);
        Duration::from_secs_f64((self.work() as f64 / tuning().search.steps_per_second).min(patience.as_secs_f64()))
    }
}
