//! Signals of other rates and clocks on one grid of rows.

use backdrive_plant::model::Hold;

/// A recorded signal.
#[derive(Debug, Clone, Default)]
pub(crate) struct Series {
    /// Header stamps, ns; of messages without one, or with none filled in, the log time.
    pub stamps: Vec<i64>,
    /// Log times, ns.
    pub logged: Vec<i64>,
    pub values: Vec<f64>,
    /// Whether every message had a header stamp.
    pub stamped: bool,
}

/// A signal in order of time, without repeated times and without what was not measured.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ordered {
    /// ns since the first message of all.
    pub times: Vec<i64>,
    pub values: Vec<f64>,
    pub disordered: usize,
    /// Mean interval, gaps left out, ns; 0 for fewer than two values.
    pub interval: i64,
    /// Nine in ten intervals deviate by less from it, ns.
    pub jitter: i64,
}

/// Times of rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grid {
    pub start: i64,
    /// ns, not whole.
    pub period: f64,
    pub rows: usize,
}

/// An interval longer than this many usual ones is a gap.
const GAP: f64 = 1.5;
/// A value older than this many intervals of its signal is a gap.
const LONGEST_INTERVALS: i64 = 4;

impl Series {
    /// Median of log time less stamp, ns: how far the sender's clock is behind the recorder's, transport included.
    pub fn clock_offset(&self) -> i64 {
        let mut offsets: Vec<i64> = self.logged.iter().zip(&self.stamps).map(|(l, s)| l.saturating_sub(*s)).collect();
        median(&mut offsets)
    }

    /// In order, with `shift` added to the stamps and `origin` taken off them.
    pub fn ordered(&self, shift: i64, origin: i64) -> Ordered {
        let time = |stamp: &i64| stamp.saturating_add(shift).saturating_sub(origin);
        let mut points: Vec<(i64, f64)> = self.stamps.iter().map(time).zip(self.values.iter().copied()).collect();
        let disordered = points.windows(2).filter(|p| p[1].0 <= p[0].0).count();
        points.retain(|p| p.1.is_finite());
        points.sort_by_key(|p| p.0);
        // Of two at one time the later counts.
        points.reverse();
        points.dedup_by_key(|p| p.0);
        points.reverse();
        let mut intervals: Vec<i64> = points.windows(2).map(|p| p[1].0 - p[0].0).collect();
        let usual = median(&mut intervals);
        intervals.retain(|i| *i as f64 <= GAP * usual as f64);
        let interval = intervals.iter().sum::<i64>() / (intervals.len() as i64).max(1);
        let mut deviations: Vec<i64> = intervals.iter().map(|i| (i - interval).abs()).collect();
        deviations.sort_unstable();
        let jitter = deviations.get(deviations.len() * 9 / 10).copied().unwrap_or(0);
        let (times, values) = points.into_iter().unzip();
        Ordered { times, values, disordered, interval, jitter }
    }
}

fn median(values: &mut [i64]) -> i64 {
    values.sort_unstable();
    values.get(values.len() / 2).copied().unwrap_or(0)
}

impl Grid {
    /// Rows over the time that all of `signals` cover, at `rate_hz` or else at the rate of the most frequent of them.
    ///
    /// # Errors
    /// One sentence: no time in common, too few rows or more than can be.
    pub fn over(signals: &[&Ordered], rate_hz: Option<f64>) -> Result<Grid, String> {
        let first = signals.iter().filter_map(|s| s.times.first()).max().copied();
        let last = signals.iter().filter_map(|s| s.times.last()).min().copied();
        let (Some(first), Some(last)) = (first, last) else { return Err("no signal has a value".to_owned()) };
        if last <= first {
            return Err("the signals do not overlap in time".to_owned());
        }
        let frequent = signals.iter().filter(|s| s.interval > 0).min_by_key(|s| s.interval);
        let period = match (rate_hz, frequent) {
            (Some(rate), _) => 1e9 / rate,
            (None, Some(signal)) => even_period(signal),
            (None, None) => return Err("each signal has only one value".to_owned()),
        };
        // On the stamps of the most frequent one, so that its values are not touched.
        let start = match (rate_hz, frequent) {
            (None, Some(signal)) => signal.times.iter().copied().find(|t| *t >= first).unwrap_or(first),
            _ => first,
        };
        let rows = (((last - start) as f64 + 1.0) / period).floor() + 1.0;
        if rows < 16.0 {
            return Err(format!("the signals overlap for only {:.3} s", (last - first) as f64 * 1e-9));
        }
        if rows > MOST_ROWS {
            return Err(format!("{rows} rows are more than {MOST_ROWS}; lower resample.rate_hz"));
        }
        Ok(Grid { start, period, rows: rows as usize })
    }

    fn time(&self, row: usize) -> i64 {
        self.start + (row as f64 * self.period).round() as i64
    }
}

const MOST_ROWS: f64 = 1e8;

/// From first to last over all intervals where there are no gaps, else the mean of those that are none, ns.
pub(crate) fn even_period(signal: &Ordered) -> f64 {
    let usual = signal.interval as f64;
    let gaps = signal.times.windows(2).filter(|t| (t[1] - t[0]) as f64 > GAP * usual).count();
    match (signal.times.first(), signal.times.last()) {
        (Some(first), Some(last)) if gaps == 0 && signal.times.len() > 1 => (last - first) as f64 / (signal.times.len() - 1) as f64,
        _ => usual,
    }
}

/// A signal on a grid.
#[derive(Debug, Clone, Default)]
pub(crate) struct Resampled {
    pub values: Vec<f64>,
    /// Rows without a value.
    pub missing: usize,
    /// Mean age of a held value, s; 0 for an interpolated one.
    pub delay_s: f64,
}

impl Ordered {
    /// The signal at the rows of a grid. Linear: between its two neighbours. Zero: the newest one, three times its jitter
    /// being forgiven; of a signal about as frequent as the grid the nearest one: so that jitter does not turn into a delay. Across a gap of more than four intervals there is none.
    pub fn on(&self, grid: &Grid, hold: Hold) -> Resampled {
        let longest = self.interval.saturating_mul(LONGEST_INTERVALS).max((2.0 * grid.period) as i64);
        let frequent = self.interval as f64 <= 1.5 * grid.period;
        let half = (0.5 * grid.period) as i64;
        let early = if frequent { half } else { self.jitter.saturating_mul(3).max((1e-3 * grid.period) as i64).min(half) };
        let mut found = Resampled { values: Vec::with_capacity(grid.rows), ..Resampled::default() };
        let (mut next, mut ages, mut held) = (0, 0.0, 0_usize);
        for row in 0..grid.rows {
            let time = grid.time(row);
            let reach = if hold == Hold::Zero { time + early } else { time };
            while self.times.get(next).is_some_and(|t| *t <= reach) {
                next += 1;
            }
            let before = next.checked_sub(1).and_then(|i| Some((*self.times.get(i)?, *self.values.get(i)?)));
            let after = self.times.get(next).copied().zip(self.values.get(next).copied());
            let value = match (hold, before, after) {
                (_, Some((t, x)), _) if t == time => Some(x),
                (Hold::Zero, Some((t, x)), _) if time - t <= longest => {
                    ages += (time - t) as f64;
                    held += 1;
                    Some(x)
                }
                // A last value that the rounding of rows has put a little before the row.
                (Hold::Linear | Hold::Cubic, Some((t, x)), None) if time - t <= 2 => Some(x),
                (Hold::Linear | Hold::Cubic, Some((t0, x0)), Some((t1, x1))) if t1 - t0 <= longest => {
                    Some(x0 + (x1 - x0) * (time - t0) as f64 / (t1 - t0) as f64)
                }
                _ => None,
            };
            found.missing += usize::from(value.is_none());
            found.values.push(value.unwrap_or(f64::NAN));
        }
        found.delay_s = if held > 0 { ages / grid.rows as f64 * 1e-9 } else { 0.0 };
        found
    }
}

/// The step by which a sensor rounds: the smallest change, if nearly all others are multiples of it; else 0.
pub(crate) fn step_of(values: &[f64]) -> f64 {
    let changes: Vec<f64> = values.windows(2).map(|v| (v[1] - v[0]).abs()).filter(|d| *d > 0.0 && d.is_finite()).collect();
    let size = values.iter().filter(|v| v.is_finite()).fold(0.0_f64, |m, v| m.max(v.abs()));
    // The rounding error of a subtraction is no step.
    let real = || changes.iter().copied().filter(|d| *d > 1e-12 * size);
    let smallest = real().fold(f64::INFINITY, f64::min);
    let count = real().count();
    if count < 20 || !smallest.is_finite() {
        return 0.0;
    }
    let largest_ratio = 1000.0;
    let multiple = |d: &f64| {
        let ratio = d / smallest;
        ratio > largest_ratio || (ratio - ratio.round()).abs() < 0.02
    };
    let few = real().filter(|d| d / smallest <= largest_ratio).count();
    let fits = real().filter(multiple).count();
    if fits * 100 >= 95 * count && few * 2 >= count { smallest } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(times: impl Iterator<Item = i64>, f: impl Fn(f64) -> f64) -> Series {
        let stamps: Vec<i64> = times.collect();
        let values = stamps.iter().map(|t| f(*t as f64 * 1e-9)).collect();
        Series { logged: stamps.clone(), stamps, values, stamped: true }
    }

    #[test]
    fn the_most_frequent_signal_gives_the_rows_and_keeps_its_values() {
        let fast = series((0..1000).map(|k| k * 1_000_000), |t| (7.0 * t).sin());
        let slow = series((0..250).map(|k| k * 4_000_000 + 300_000), |t| 2.0 * t);
        let (fast, slow) = (fast.ordered(0, 0), slow.ordered(0, 0));
        let grid = Grid::over(&[&fast, &slow], None).unwrap();
        assert_eq!((grid.start, grid.period), (1_000_000, 1e6));
        let (x, line) = (fast.on(&grid, Hold::Linear), slow.on(&grid, Hold::Linear));
        assert_eq!(x.values, fast.values[1..=grid.rows]);
        for (row, value) in line.values.iter().enumerate() {
            assert!((value - 2.0 * (row as f64 + 1.0) * 1e-3).abs() < 1e-12);
        }
        // Rows 0.7, 1.7, 2.7 and 3.7 ms behind a value that comes every 4 ms.
        let held = slow.on(&grid, Hold::Zero);
        assert!((held.delay_s - 2.2e-3).abs() < 1e-5, "{}", held.delay_s);
        assert_eq!((x.missing, line.missing, held.missing), (0, 0, 0));
    }

    #[test]
    fn jitter_delays_nothing_and_gaps_are_gaps() {
        let jittery = |k: i64| k * 1_000_000 + (k * 7919 % 401 - 200) * 1000;
        let force = series((0..1000).filter(|k| !(500..520).contains(k)).map(jittery), |t| t).ordered(0, 0);
        let grid = Grid { start: 0, period: 1e6, rows: 990 };
        let found = force.on(&grid, Hold::Zero);
        let worst = found.values.iter().enumerate().filter(|(_, v)| v.is_finite()).filter(|(row, _)| !(499..521).contains(row));
        assert!(worst.map(|(row, v)| (v - row as f64 * 1e-3).abs()).fold(0.0, f64::max) < 3e-4);
        assert!((15..=17).contains(&found.missing), "{}", found.missing);
        assert!((1e5..4e5).contains(&(force.jitter as f64)) && force.disordered == 0);
    }

    #[test]
    fn a_sensor_shows_its_step() {
        let x: Vec<f64> = (0..4000).map(|i| 0.01 * (i as f64 * 0.002).sin()).collect();
        let rounded: Vec<f64> = x.iter().map(|x| (x / 5e-6).round() * 5e-6).collect();
        assert!((step_of(&rounded) / 5e-6 - 1.0).abs() < 1e-6);
        assert_eq!(step_of(&x), 0.0);
    }
}
