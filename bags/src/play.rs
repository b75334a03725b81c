//! Sends a bag's messages again, when they were sent: verbatim, with the loop open.

use crate::{BagError, Entry, Reader};
use backdrive_msgs::Message;
use serde::Serialize;
use std::time::{Duration, Instant};

/// Where played messages go, and whose clock is followed.
pub trait Sink {
    /// Sends a message; `message` is `None` for a type that is not ours, whose bytes are in `entry`.
    ///
    /// An error ends the playback and is handed on.
    fn send(&mut self, entry: &Entry, message: Option<&Message>) -> Result<(), BagError>;

    /// Waits until `due` after the start of the playback; `false` ends it.
    ///
    /// As given it sleeps in pieces of at most 50 ms, and asks [`Sink::stopped`] between them.
    fn wait(&mut self, start: Instant, due: Duration) -> bool {
        loop {
            if self.stopped() {
                return false;
            }
            match due.checked_sub(start.elapsed()) {
                None | Some(Duration::ZERO) => return true,
                Some(left) => std::thread::sleep(left.min(Duration::from_millis(50))),
            }
        }
    }

    /// Whether somebody wants it to end.
    fn stopped(&self) -> bool {
        false
    }
}

/// How to play.
#[derive(Debug, Clone, PartialEq)]
pub struct PlayOptions {
    /// Seconds of the bag per second: 2 is twice as fast, infinity as fast as the sink takes it.
    pub rate: f64,
    /// Topics to play; all when empty.
    pub topics: Vec<String>,
    /// Where to begin, s after the first message.
    pub from_s: f64,
    /// Where to end, s after the first message.
    pub until_s: f64,
}

impl Default for PlayOptions {
    fn default() -> PlayOptions {
        PlayOptions { rate: 1.0, topics: Vec::new(), from_s: 0.0, until_s: f64::INFINITY }
    }
}

/// What was played.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PlayReport {
    /// Messages sent.
    pub sent: u64,
    /// How late the latest of them was, s of real time.
    pub latest_s: f64,
    /// Whether it came to the end.
    pub finished: bool,
}

/// Plays a bag in the order of its file. A message whose log time lies before that of one already sent is sent at once.
///
/// Errors: a rate that is not above 0, a topic that is not there, a damaged bag, an error of the sink.
pub fn play(reader: &Reader, options: &PlayOptions, sink: &mut dyn Sink) -> Result<PlayReport, BagError> {
    if options.rate.is_nan() || options.rate <= 0.0 {
        return Err(BagError::Usage(format!("a playback rate of {} is not above 0", options.rate)));
    }
    for name in &options.topics {
        reader.topic(name)?;
    }
    let (start, mut report, mut begin) = (Instant::now(), PlayReport::default(), None);
    for entry in reader.messages()? {
        let entry = entry?;
        let begin = *begin.get_or_insert(entry.log_time_ns);
        if !options.topics.is_empty() && !options.topics.contains(&entry.topic.name) {
            continue;
        }
        let after = entry.log_time_ns.saturating_sub(begin) as f64 * 1e-9;
        if after < options.from_s || after > options.until_s {
            continue;
        }
        let due = due(after - options.from_s, options.rate);
        if !sink.wait(start, due) {
            return Ok(report);
        }
        let message = entry.message(reader.path())?;
        sink.send(&entry, message.as_ref())?;
        report.sent += 1;
        if options.rate.is_finite() {
            report.latest_s = report.latest_s.max(start.elapsed().saturating_sub(due).as_secs_f64());
        }
    }
    report.finished = true;
    Ok(report)
}

/// When a message is due that lies this number of seconds after the beginning.
fn due(after_s: f64, rate: f64) -> Duration {
    Duration::try_from_secs_f64(after_s / rate).unwrap_or(Duration::MAX)
}
