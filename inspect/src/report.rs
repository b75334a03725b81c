//! The answer as a value.

use crate::finding::{Finding, Weight};
use crate::quantity::Quantity;
use crate::response::Response;
use serde::Serialize;

/// What is known of a signal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SignalReport {
    /// The recording.
    pub file: String,
    /// The column, or `TOPIC.FIELD`.
    pub name: String,
    /// The joint; empty where it has no name.
    pub joint: String,
    /// What it probably is.
    pub quantity: Quantity,
    /// The unit that its heading states or its name hints at; `None` where neither does.
    pub unit: Option<String>,
    /// How surely it is that quantity, 0 to 1.
    pub sure: f64,
    /// Why.
    pub why: String,
    /// Smallest and largest value, in the unit of the file.
    pub range: [f64; 2],
    /// The step of its values, in the unit of the file, where they have one.
    pub step: Option<f64>,
    /// Standard deviation of its white noise, in the unit of the file.
    pub noise: Option<f64>,
}

/// What is known of a clock.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClockReport {
    /// The recording.
    pub file: String,
    /// The topic; empty for a table.
    pub topic: String,
    /// Rows or messages.
    pub samples: usize,
    /// Samples per second, by the usual step, Hz.
    pub rate_hz: f64,
    /// Standard deviation of the steps, ms.
    pub jitter_ms: f64,
    /// From the first to the last, s.
    pub duration_s: f64,
}

/// The answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The recordings.
    pub files: Vec<String>,
    /// Their clocks.
    pub clocks: Vec<ClockReport>,
    /// Their signals.
    pub signals: Vec<SignalReport>,
    /// How joints answer their commands.
    pub responses: Vec<Response>,
    /// What is wrong, and what should be known; those that matter most first.
    pub findings: Vec<Finding>,
    /// What a person should know of the files.
    pub notes: Vec<String>,
}

impl Report {
    /// Findings that are wrong.
    pub fn wrong(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| finding.weight == Weight::Wrong)
    }

    /// The answer in one sentence.
    pub fn sentence(&self) -> String {
        let (wrong, notes) = (self.wrong().count(), self.findings.len() - self.wrong().count());
        let files = match self.files.as_slice() {
            [one] => one.clone(),
            files => format!("{} recordings", files.len()),
        };
        let plural = |count: usize, word: &str| if count == 1 { format!("1 {word}") } else { format!("{count} {word}s") };
        match (wrong, notes) {
            (0, 0) => format!("{files}: no problem found"),
            (0, notes) => format!("{files}: no problem found; {}", plural(notes, "note")),
            (1, _) => format!("{files}: 1 problem found"),
            (wrong, _) => format!("{files}: {wrong} problems found"),
        }
    }
}
