//! Times of clocks, and between moments.

use nix::time::{ClockId, clock_gettime};
use std::time::{Duration, Instant};

pub(super) fn nanoseconds(clock: ClockId) -> i64 {
    clock_gettime(clock).map_or(Duration::ZERO, Duration::from).as_nanos() as i64
}

/// Negative if `at` is in the future.
pub(crate) fn seconds_since(now: Instant, at: Instant) -> f64 {
    now.saturating_duration_since(at).as_secs_f64() - at.saturating_duration_since(now).as_secs_f64()
}
