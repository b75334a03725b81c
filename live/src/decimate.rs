//! Minima and maxima of curves over 1/60 s, and what is kept of them for who comes later.

use std::collections::VecDeque;

/// Intervals per second of the run.
pub(crate) const PER_S: f64 = 60.0;

/// Intervals that are kept: two minutes.
const KEPT: usize = 120 * 60;

/// An interval stays open until a sample of the one after next has come: topics arrive one after the other.
const OPEN: u64 = 2;

/// Least and greatest value of a curve in an interval; NaN where it has none.
pub(crate) type Range = [f32; 2];

const EMPTY: Range = [f32::NAN, f32::NAN];

/// All curves in one interval.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Interval {
    /// Its number, from the start of the run.
    pub number: u64,
    /// By the numbers of the curves; curves that came later are not in it.
    pub ranges: Vec<Range>,
}

impl Interval {
    fn put(&mut self, curve: u16, value: f64) {
        let curve = usize::from(curve);
        if self.ranges.len() <= curve {
            self.ranges.resize(curve + 1, EMPTY);
        }
        let range = &mut self.ranges[curve];
        // The minimum of a NaN and a number is the number.
        *range = [range[0].min(value as f32), range[1].max(value as f32)];
    }
}

/// Collects values into intervals.
#[derive(Debug, Default)]
pub(crate) struct Decimator {
    open: VecDeque<Interval>,
    /// Closed intervals, the oldest first.
    pub kept: VecDeque<Interval>,
    next: u64,
    /// Values of intervals that were closed already.
    pub late: u64,
}

impl Decimator {
    /// A value of a curve at a time of the run, s.
    pub fn put(&mut self, curve: u16, time_s: f64, value: f64) {
        let number = (time_s * PER_S).floor().max(0.0) as u64;
        if number < self.next {
            self.late += 1;
            return;
        }
        let at = match self.open.iter().position(|i| i.number >= number) {
            Some(at) if self.open[at].number == number => at,
            found => {
                let at = found.unwrap_or(self.open.len());
                self.open.insert(at, Interval { number, ranges: Vec::new() });
                at
            }
        };
        self.open[at].put(curve, value);
    }

    /// Takes out the intervals that are complete; at the end all of them.
    pub fn close(&mut self, end: bool) -> Vec<Interval> {
        let newest = self.open.back().map_or(0, |i| i.number);
        let count = if end { self.open.len() } else { self.open.iter().take_while(|i| i.number + OPEN <= newest).count() };
        let closed: Vec<Interval> = self.open.drain(..count).collect();
        if let Some(last) = closed.last() {
            self.next = last.number + 1;
        }
        self.kept.extend(closed.iter().cloned());
        self.kept.drain(..self.kept.len().saturating_sub(KEPT));
        closed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_has_the_extremes_of_its_samples() {
        let mut decimator = Decimator::default();
        let rate = 5000.0;
        for step in 0..5000 {
            let t = f64::from(step) / rate;
            decimator.put(1, t, (2.0 * std::f64::consts::PI * 200.0 * t).sin());
            // A spike of a single sample is not lost.
            if step == 2500 {
                decimator.put(0, t, 7.0);
            }
        }
        let closed = decimator.close(false);
        assert_eq!(closed.len(), 58, "the last two are open");
        assert!(closed.iter().enumerate().all(|(i, interval)| interval.number == i as u64));
        // 200 Hz: every interval has whole periods.
        assert!(closed.iter().all(|i| i.ranges[1][0] < -0.99 && i.ranges[1][1] > 0.99));
        let with_spike: Vec<u64> = closed.iter().filter(|i| i.ranges[0][0] == 7.0).map(|i| i.number).collect();
        assert_eq!(with_spike, [30]);
        assert!(closed[0].ranges[0][0].is_nan());
        assert_eq!(decimator.close(true).len(), 2);
    }

    #[test]
    fn topics_that_come_one_after_the_other_share_intervals_and_late_values_are_counted() {
        let mut decimator = Decimator::default();
        (0..4).for_each(|i| decimator.put(0, f64::from(i) / PER_S + 1e-3, 1.0));
        (0..4).for_each(|i| decimator.put(1, f64::from(i) / PER_S + 1e-3, 2.0));
        let closed = decimator.close(false);
        assert_eq!(closed.iter().map(|i| i.ranges.len()).collect::<Vec<_>>(), [2, 2]);
        decimator.put(1, 0.0, 3.0);
        assert_eq!(decimator.late, 1);
        assert_eq!(decimator.kept.len(), 2);
    }
}
