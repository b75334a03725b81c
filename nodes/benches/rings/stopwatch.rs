//! How long each loop took: the same clock for every kind of ring.

use backdrive_nodes::clock::now_ns;
use backdrive_nodes::histogram::Histogram;

/// loops/s, p50 µs, p99 µs.
pub type Figures = [f64; 3];

/// The figures' medians over several runs.
pub fn medians(runs: &[Figures]) -> Figures {
    let median = |i: usize| {
        let mut values: Vec<f64> = runs.iter().map(|r| r[i]).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
    };
    [median(0), median(1), median(2)]
}

/// Loops that go by before the first one that counts.
pub fn warm_up(loops: u64) -> u64 {
    loops / 10
}

/// Looked at once per loop; the loops of the warm-up are not counted.
pub struct Stopwatch {
    looks: u64,
    warm_up: u64,
    begun: i64,
    before: i64,
    histogram: Histogram,
}

impl Stopwatch {
    /// `loops` are those that count.
    pub fn new(loops: u64) -> Stopwatch {
        Stopwatch { looks: 0, warm_up: warm_up(loops), begun: 0, before: 0, histogram: Histogram::default() }
    }

    /// A loop ends here and the next one begins.
    pub fn look(&mut self) {
        let now = now_ns();
        if self.looks > self.warm_up {
            self.histogram.record((now - self.before).max(0) as u64);
        } else {
            self.begun = now;
        }
        self.looks += 1;
        self.before = now;
    }

    pub fn figures(&self) -> Figures {
        let loops = self.looks.saturating_sub(self.warm_up + 1);
        let seconds = (self.before - self.begun) as f64 * 1e-9;
        [loops as f64 / seconds, self.histogram.quantile(0.5) * 1e-3, self.histogram.quantile(0.99) * 1e-3]
    }
}
