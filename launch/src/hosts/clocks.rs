//! The clock of another host, from round trips that are timed on this one.
//!
//! A question leaves at `a` and its answer, which holds the other's clock `b`, is here at `c`. The other's clock is ahead by `b - (a + c) / 2`, with
//! an error of at most `(c - a) / 2`, whichever way took longer (Cristian 1989). Of the last round trips the shortest is believed, with what two
//! clocks may have drifted since.

use backdrive_bags::ClockOffset;
use nix::time::{ClockId, clock_gettime};
use std::collections::VecDeque;

/// Round trips that are kept: a minute of them.
const KEPT: usize = 240;

/// Most by which two undisciplined clocks part, s/s (100 ppm; common crystals keep 50 each).
const DRIFT: f64 = 100e-6;

/// CLOCK_MONOTONIC now, ns.
pub(super) fn monotonic_ns() -> i64 {
    read(ClockId::CLOCK_MONOTONIC)
}

/// The wall clock now, ns since the Unix epoch.
pub(super) fn unix_ns() -> i64 {
    read(ClockId::CLOCK_REALTIME)
}

fn read(clock: ClockId) -> i64 {
    clock_gettime(clock).map_or(0, |t| t.tv_sec() * 1_000_000_000 + t.tv_nsec())
}

struct Trip {
    at_ns: i64,
    round_trip_ns: i64,
    monotonic_ns: i64,
    unix_ns: i64,
}

/// Round trips to another host.
#[derive(Default)]
pub(super) struct Clocks {
    trips: VecDeque<Trip>,
}

impl Clocks {
    /// An answer is here: to what was asked at `asked_ns`, with the other's clocks.
    pub fn take(&mut self, asked_ns: i64, there_ns: i64, there_unix_ns: i64) {
        let (now, unix) = (monotonic_ns(), unix_ns());
        self.add(asked_ns, now, unix, there_ns, there_unix_ns);
    }

    fn add(&mut self, asked_ns: i64, now_ns: i64, now_unix_ns: i64, there_ns: i64, there_unix_ns: i64) {
        let round_trip_ns = now_ns - asked_ns;
        if round_trip_ns < 0 {
            return;
        }
        let half = round_trip_ns / 2;
        let trip = Trip {
            at_ns: now_ns,
            round_trip_ns,
            monotonic_ns: there_ns - (asked_ns + half),
            unix_ns: there_unix_ns - (now_unix_ns - half),
        };
        // A wall clock that was stepped makes all that was measured before worthless.
        if self.trips.back().is_some_and(|last| (last.unix_ns - trip.unix_ns).abs() > last.round_trip_ns + round_trip_ns + 10_000_000) {
            self.trips.clear();
        }
        if self.trips.len() == KEPT {
            self.trips.pop_front();
        }
        self.trips.push_back(trip);
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.trips.len()
    }

    /// The one to believe: half its length and the drift since are the least.
    fn best(&self) -> Option<(&Trip, i64)> {
        let now = self.trips.back()?.at_ns;
        let wrong = |t: &Trip| t.round_trip_ns / 2 + ((now - t.at_ns) as f64 * DRIFT) as i64;
        self.trips.iter().map(|t| (t, wrong(t))).min_by_key(|(_, wrong)| *wrong)
    }

    /// By how much the other's CLOCK_MONOTONIC is ahead, ns.
    pub fn monotonic(&self) -> Option<i64> {
        self.best().map(|(trip, _)| trip.monotonic_ns)
    }

    /// The other's wall clock against this host's.
    pub fn unix(&self, of: &str, against: &str) -> Option<ClockOffset> {
        let (trip, uncertainty_ns) = self.best()?;
        Some(ClockOffset {
            of: of.to_string(),
            against: against.to_string(),
            offset_ns: trip.unix_ns,
            uncertainty_ns,
            round_trip_ns: trip.round_trip_ns,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Another host whose clocks are ahead by these, over a way that takes `there` and back `back`, ns.
    fn trip(clocks: &mut Clocks, at: i64, ahead: i64, unix_ahead: i64, there: i64, back: i64) {
        let unix = 1_700_000_000_000_000_000;
        let (arrived, now) = (at + there, at + there + back);
        clocks.add(at, now, unix + now, arrived + ahead, unix + arrived + unix_ahead);
    }

    #[test]
    fn the_offset_is_within_its_uncertainty_however_lopsided_the_way() {
        for (there, back) in [(1_000, 1_000), (50_000, 1_000), (1_000, 900_000), (0, 1_000_000)] {
            let mut clocks = Clocks::default();
            (0..20).for_each(|i| trip(&mut clocks, i * 1_000_000, 123_456_789, -5_000, there, back));
            let offset = clocks.unix("a", "b").unwrap();
            assert!((offset.offset_ns + 5_000).abs() <= offset.uncertainty_ns, "{offset}");
            assert!((clocks.monotonic().unwrap() - 123_456_789).abs() <= offset.uncertainty_ns);
            assert_eq!(offset.round_trip_ns, there + back);
        }
    }

    #[test]
    fn the_shortest_trip_is_believed_until_it_is_old() {
        let mut clocks = Clocks::default();
        trip(&mut clocks, 0, 0, 0, 10_000, 10_000);
        trip(&mut clocks, 1_000_000, 0, 0, 10_000, 400_000);
        assert_eq!(clocks.unix("a", "b").unwrap().round_trip_ns, 20_000);
        trip(&mut clocks, 10_000_000_000, 0, 0, 10_000, 400_000);
        assert_eq!(clocks.unix("a", "b").unwrap().round_trip_ns, 410_000);
    }

    #[test]
    fn a_stepped_wall_clock_is_measured_anew() {
        let mut clocks = Clocks::default();
        trip(&mut clocks, 0, 0, 0, 10_000, 10_000);
        trip(&mut clocks, 1_000_000, 0, -60_000_000_000, 50_000, 50_000);
        assert_eq!(clocks.unix("a", "b").unwrap().offset_ns, -60_000_000_000);
    }
}
