//! Periods and round trips of the last second, and what they amount to.

use std::time::{Duration, Instant};

/// What a second of cycles amounts to; NaN before the first second is over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    /// Cycles per second.
    pub rate_hz: f64,
    /// 99th percentile of the difference of a period from the median period, s.
    pub jitter_p99_s: f64,
    /// Median round trip, s.
    pub round_trip_p50_s: f64,
    /// 99th percentile of the round trip, s.
    pub round_trip_p99_s: f64,
}

/// Measures cycles, a second at a time.
#[derive(Debug)]
pub struct Stopwatch {
    periods: Vec<f64>,
    trips: Vec<f64>,
    last: Option<Instant>,
    since: Option<Instant>,
    times: Times,
}

impl Default for Stopwatch {
    fn default() -> Stopwatch {
        let times = Times { rate_hz: f64::NAN, jitter_p99_s: f64::NAN, round_trip_p50_s: f64::NAN, round_trip_p99_s: f64::NAN };
        let kept = || Vec::with_capacity(4096);
        Stopwatch { periods: kept(), trips: kept(), last: None, since: None, times }
    }
}

impl Stopwatch {
    /// A cycle began and ended.
    pub fn lap(&mut self, began: Instant, ended: Instant) {
        self.trips.push((ended - began).as_secs_f64());
        if let Some(last) = self.last.replace(began) {
            self.periods.push((began - last).as_secs_f64());
        }
        let since = *self.since.get_or_insert(began);
        if began - since >= Duration::from_secs(1) && !self.periods.is_empty() {
            self.times = self.amount((began - since).as_secs_f64());
            self.since = Some(began);
            self.periods.clear();
            self.trips.clear();
        }
    }

    /// Of the last whole second.
    pub fn times(&self) -> Times {
        self.times
    }

    fn amount(&mut self, over_s: f64) -> Times {
        let median = quantile(&mut self.periods, 0.5);
        let mut jitter: Vec<f64> = self.periods.iter().map(|p| (p - median).abs()).collect();
        Times {
            rate_hz: self.periods.len() as f64 / over_s,
            jitter_p99_s: quantile(&mut jitter, 0.99),
            round_trip_p50_s: quantile(&mut self.trips, 0.5),
            round_trip_p99_s: quantile(&mut self.trips, 0.99),
        }
    }
}

/// The value below which the share `q` of the values lies; NaN of none.
pub fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get((q * last as f64).round() as usize).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_of_regular_cycles_has_their_rate_and_no_jitter() {
        let (mut watch, begin) = (Stopwatch::default(), Instant::now());
        assert!(watch.times().rate_hz.is_nan());
        for k in 0..=200u32 {
            let at = begin + k * Duration::from_millis(5);
            watch.lap(at, at + Duration::from_micros(1500 + u64::from(k == 100) * 900));
        }
        let times = watch.times();
        assert!((times.rate_hz - 200.0).abs() < 1e-6 && times.jitter_p99_s < 1e-9, "{times:?}");
        assert!((times.round_trip_p50_s - 0.0015).abs() < 1e-9 && times.round_trip_p99_s < 0.0016, "{times:?}");
    }
}
