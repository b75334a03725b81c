//! How much to search, and for what.

use crate::work::{Limit, PER_SECOND, Steps};
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
    /// How long it may take on the clock, all in all. What that cuts off may differ from machine to machine, so a verdict says where it did.
    pub patience: Duration,
}

/// What a search computes with an effort of 1.
pub const EFFORT: Steps = 1_200_000_000;

/// How long a search may take on the clock where nothing else is said: far longer than the default effort takes on a slow machine.
pub const PATIENCE: Duration = Duration::from_secs(600);

impl Default for Settings {
    fn default() -> Settings {
        Settings { without: Vec::new(), effects: 3, effort: 1.0, patience: PATIENCE }
    }
}

impl Settings {
    /// Work that the search may do.
    pub fn work(&self) -> Steps {
        (self.effort.max(0.0) * EFFORT as f64) as Steps
    }

    /// What ends a search that begins now from outside.
    pub fn limit<'a>(&self, stop: Option<&'a AtomicBool>) -> Limit<'a> {
        Limit { stop, deadline: Instant::now().checked_add(self.patience) }
    }

    /// About how long that takes on two threads of a laptop, for progress bars.
    pub fn expected(&self) -> Duration {
        Duration::from_secs_f64((self.work() as f64 / PER_SECOND).min(self.patience.as_secs_f64()))
    }
}
