//! How fast a bus is: cycles one after the other, beside what its wire allows.

use crate::bus::{Bus, BusError, Goal, Reading};
use crate::stopwatch::quantile;
use std::fmt;
use std::time::{Duration, Instant};

/// What was measured of a bus.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Survey {
    /// Cycles that were done.
    pub cycles: u64,
    /// Cycles per second, one directly after the other.
    pub rate_hz: f64,
    /// The rate at which the wire has no pause, Hz.
    pub wire_hz: f64,
    /// Median of a cycle, s.
    pub round_trip_p50_s: f64,
    /// 99th percentile of a cycle, s.
    pub round_trip_p99_s: f64,
    /// Questions that were asked again.
    pub retries: u64,
    /// Questions without an answer.
    pub silent: u64,
    /// Broken frames, and frames and bytes of somebody else.
    pub broken: u64,
}

/// Reads a bus for some time, without a pause.
///
/// # Errors
/// The port is gone.
pub fn survey(bus: &mut dyn Bus, lasts: Duration) -> Result<Survey, BusError> {
    let before = bus.counts();
    let (mut readings, goals) = (vec![Reading::default(); bus.joints()], vec![Goal::Keep; bus.joints()]);
    let (begun, mut trips) = (Instant::now(), Vec::new());
    while begun.elapsed() < lasts {
        let at = Instant::now();
        bus.write(&goals)?;
        bus.read(&mut readings)?;
        trips.push(at.elapsed().as_secs_f64());
    }
    let counts = bus.counts().since(before);
    Ok(Survey {
        cycles: trips.len() as u64,
        rate_hz: trips.len() as f64 / begun.elapsed().as_secs_f64(),
        wire_hz: 1.0 / bus.wire_time().as_secs_f64().max(1e-9),
        round_trip_p50_s: quantile(&mut trips, 0.5),
        round_trip_p99_s: quantile(&mut trips, 0.99),
        retries: counts.retries,
        silent: counts.silent,
        broken: counts.corrupt + counts.strange + counts.noise,
    })
}

impl fmt::Display for Survey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "bus       {:.0} cycles/s without a pause, the wire allows {:.0}; a cycle takes {:.2} ms (median), {:.2} ms (99 %); {} retries, {} \
             without an answer, {} broken",
            self.rate_hz,
            self.wire_hz,
            1e3 * self.round_trip_p50_s,
            1e3 * self.round_trip_p99_s,
            self.retries,
            self.silent,
            self.broken
        )
    }
}
