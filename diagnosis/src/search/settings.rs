//! How much to search, and for what.

use crate::output_error::work::{Limit, Steps};
use crate::tuning::tuning;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// How to search.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Physics that are withheld, and with them all that contain one.
    pub without: Vec<String>,
    /// Effects at once, at most.
    pub effects: usize,
    /// How much it may compute, as a multiple of what it does by default: the verdict depends on this, and not on how fast or busy a machine is.
    pub effort: f64,
    /// Limit on the wall-clock time of the whole search. What it cuts off may differ from machine to machine, so a verdict reports where it did.
    pub patience: Duration,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { without: Vec::new(), effects: 3, effort: 1.0, patience: Duration::from_secs(tuning().search.patience) }
    }
}

impl Settings {
    /// Work that the search may do.
    pub fn work(&self) -> Steps {
        (self.effort.max(0.0) * tuning().search.work as f64) as Steps
    }

    /// What ends a search that begins now from outside.
    pub fn limit<'a>(&self, stop: Option<&'a AtomicBool>) -> Limit<'a> {
        Limit { stop, deadline: Instant::now().checked_add(self.patience) }
    }

    /// About how long that takes on two threads of a laptop, for progress bars.
    pub fn expected(&self) -> Duration {
        Duration::from_secs_f64((self.work() as f64 / tuning().search.steps_per_second).min(self.patience.as_secs_f64()))
    }
}
