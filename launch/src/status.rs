//! How a run does, in one line.

use std::time::Duration;

/// How a run does at a moment. What is not measured is `None`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Summary {
    /// What it does: empty while it runs, or such as `waiting for slave`.
    pub doing: String,
    /// Time since step 0, wall clock.
    pub elapsed: Duration,
    /// Steps done.
    pub steps: u64,
    /// Steps to do; `None` where it runs until it is stopped.
    pub planned: Option<u64>,
    /// Steps per second that the graph asks for.
    pub rate_hz: f64,
    /// Whether time is real: else the rate is compared with nothing.
    pub realtime: bool,
    /// Steps per second of wall-clock time, of the last second.
    pub steps_per_s: Option<f64>,
    /// Time for one step, median, µs.
    pub loop_p50_us: Option<f64>,
    /// The same, 99th percentile, µs.
    pub loop_p99_us: Option<f64>,
    /// Samples and messages lost, at all nodes and the recorder.
    pub lost: u64,
    /// Messages refused because their sender is not of the run.
    pub refused: u64,
    /// Steps that ended after their deadline.
    pub missed_deadlines: u64,
    /// Largest magnitude of effort in the last second, N.
    pub peak_effort: Option<f64>,
    /// The loop's stability margin, such as `margin 2.4x at 71 Hz`.
    pub margin: Option<String>,
    /// Bytes of the bag.
    pub bag_bytes: Option<u64>,
    /// Nodes that died and are not back.
    pub dead: Vec<String>,
}

impl Summary {
    /// Time until the planned end at the rate of the last second; in real time at the graph's.
    pub fn remaining(&self) -> Option<Duration> {
        let rate = if self.realtime { self.rate_hz } else { self.steps_per_s? };
        let left = self.planned?.saturating_sub(self.steps) as f64 / rate;
        Duration::try_from_secs_f64(left).ok()
    }

    /// The most important first: a narrow terminal cuts the end off.
    pub fn line(&self) -> String {
        if !self.doing.is_empty() {
            return self.doing.clone();
        }
        let mut parts = Vec::new();
        if !self.dead.is_empty() {
            parts.push(format!("DEAD: {}", self.dead.join(", ")));
        }
        if let Some(rate) = self.steps_per_s {
            parts.push(match self.realtime {
                true => format!("{} of {} Hz", count(rate), count(self.rate_hz)),
                false => format!("{} steps/s ({} x real time)", count(rate), factor(rate / self.rate_hz)),
            });
        }
        if let Some(p50) = self.loop_p50_us {
            let p99 = self.loop_p99_us.map(|v| format!(" p99 {}", micros(v))).unwrap_or_default();
            parts.push(format!("loop p50 {}{p99}", micros(p50)));
        }
        if self.refused > 0 {
            parts.push(format!("STRANGER: {} messages refused", self.refused));
        }
        parts.push(format!("lost {}", self.lost));
        if self.realtime {
            parts.push(format!("late {}", self.missed_deadlines));
        }
        if let Some(peak) = self.peak_effort {
            parts.push(format!("peak {peak:.2} N"));
        }
        parts.extend(self.margin.clone());
        if let Some(bytes) = self.bag_bytes {
            parts.push(format!("bag {}", bytes_of(bytes)));
        }
        parts.join(", ")
    }

    /// The line with its place in time, for where there is no bar.
    pub fn plain(&self) -> String {
        if !self.doing.is_empty() {
            return self.doing.clone();
        }
        let at = clock(self.elapsed);
        match (self.planned, self.remaining()) {
            (Some(planned), Some(left)) => {
                let share = 100.0 * self.steps as f64 / planned.max(1) as f64;
                format!("{at}, {share:.0} %, {} left: {}", clock(left), self.line())
            }
            _ => format!("{at}: {}", self.line()),
        }
    }
}

/// A duration as a person reads it, such as `4.2 s` or `1:02:03`.
pub fn clock(time: Duration) -> String {
    let s = time.as_secs();
    match s {
        0..60 => format!("{:.1} s", time.as_secs_f64()),
        60..3600 => format!("{}:{:02}", s / 60, s % 60),
        _ => format!("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60),
    }
}

/// Three digits, grouped where there are more.
fn count(value: f64) -> String {
    match value {
        v if v >= 99_999.5 => format!("{:.0} k", v / 1e3),
        v if v >= 9_999.5 => format!("{:.1} k", v / 1e3),
        v if v >= 99.95 => format!("{v:.0}"),
        v => format!("{v:.1}"),
    }
}

fn factor(value: f64) -> String {
    if value >= 10.0 { format!("{value:.0}") } else { format!("{value:.1}") }
}

fn micros(value: f64) -> String {
    match value {
        v if v >= 10_000.0 => format!("{:.0} ms", v / 1e3),
        v if v >= 1_000.0 => format!("{:.1} ms", v / 1e3),
        v if v >= 10.0 => format!("{v:.0} µs"),
        v => format!("{v:.1} µs"),
    }
}

/// Decimal units, as disks are sold.
pub fn bytes_of(bytes: u64) -> String {
    let b = bytes as f64;
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.0} kB", b / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", b / 1e6),
        _ => format!("{:.2} GB", b / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn running() -> Summary {
        Summary {
            elapsed: Duration::from_millis(4200),
            steps: 4200,
            planned: Some(10_000),
            rate_hz: 1000.0,
            realtime: true,
            steps_per_s: Some(999.6),
            loop_p50_us: Some(43.2),
            loop_p99_us: Some(1210.0),
            peak_effort: Some(4.126),
            margin: Some("margin 2.4x at 71 Hz".to_string()),
            bag_bytes: Some(1_240_000),
            missed_deadlines: 3,
            ..Summary::default()
        }
    }

    #[test]
    fn says_how_it_does() {
        let mut summary = running();
        assert_eq!(
            summary.line(),
            "1000 of 1000 Hz, loop p50 43 µs p99 1.2 ms, lost 0, late 3, peak 4.13 N, margin 2.4x at 71 Hz, bag 1.2 MB"
        );
        assert_eq!(summary.plain(), format!("4.2 s, 42 %, 5.8 s left: {}", summary.line()));
        summary.dead.push("slave".to_string());
        assert!(summary.line().starts_with("DEAD: slave, "));
        summary.refused = 12;
        assert!(summary.line().contains(", STRANGER: 12 messages refused, lost 0"), "{}", summary.line());
        summary.planned = None;
        assert!(summary.plain().starts_with("4.2 s: DEAD"));
    }

    #[test]
    fn in_lockstep_the_rate_is_compared_with_real_time() {
        let summary = Summary { realtime: false, steps_per_s: Some(41_234.0), ..running() };
        assert!(summary.line().starts_with("41.2 k steps/s (41 x real time)"), "{}", summary.line());
        assert!(!summary.line().contains("late"));
        assert_eq!(summary.remaining().map(|d| d.as_millis()), Some(140));
    }

    #[test]
    fn what_is_not_measured_is_not_shown() {
        let summary = Summary { rate_hz: 1000.0, ..Summary::default() };
        assert_eq!(summary.line(), "lost 0");
        assert_eq!(summary.remaining(), None);
    }

    #[test]
    fn times_and_sizes() {
        assert_eq!(clock(Duration::from_secs(3723)), "1:02:03");
        assert_eq!(clock(Duration::from_secs(62)), "1:02");
        assert_eq!(bytes_of(999), "999 B");
        assert_eq!(bytes_of(2_500_000_000), "2.50 GB");
    }
}
