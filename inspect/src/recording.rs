//! A recording in memory: streams with their clocks, signals as they stand and on an even clock.

use crate::quantity::{Quantity, Side};
use backdrive_plant::recording::units::Unit;

/// Signals that share their times.
#[derive(Debug, Clone, Default)]
pub struct Stream {
    /// The topic of a bag; empty for a table.
    pub topic: String,
    /// Times of the rows as they stand, s.
    pub times: Vec<f64>,
    /// Of a bag: when each message was logged, s from the same beginning.
    pub logged: Vec<f64>,
    /// Of text: the line of each row, from 1.
    pub lines: Vec<u64>,
}

impl Stream {
    /// A row (from 0) as a person counts it: the line of a text, else from 1.
    pub fn row(&self, row: usize) -> usize {
        self.lines.get(row).map_or(row + 1, |line| *line as usize)
    }

    /// The word for such a row.
    pub fn row_word(&self) -> &'static str {
        if self.lines.is_empty() { "row" } else { "line" }
    }

    /// Time of a row, s from the first.
    pub fn time(&self, row: usize) -> f64 {
        let first = self.times.first().copied().unwrap_or(0.0);
        self.times.get(row).copied().unwrap_or(first) - first
    }
}

/// A signal of a recording.
#[derive(Debug, Clone)]
pub struct Signal {
    /// Its heading without the unit; of a bag `TOPIC.FIELD`.
    pub name: String,
    /// The topic, and the field of it; `None` for a column.
    pub field: Option<String>,
    /// Place of its stream.
    pub stream: usize,
    /// The unit that its heading states.
    pub stated: Option<Unit>,
    /// The unit that its name hints at.
    pub hint: Option<Unit>,
    /// What it is.
    pub quantity: Quantity,
    /// How surely it is that, 0 to 1.
    pub sure: f64,
    /// Why.
    pub why: String,
    /// Which device of a pair.
    pub side: Option<Side>,
    /// The joint; empty where the name states none.
    pub joint: String,
    /// As it stands in the file, one a row of its stream.
    pub values: Vec<f64>,
    /// In SI units as far as a unit is stated or hinted, on the recording's even clock. Empty where there is nothing to compare.
    pub even: Vec<f64>,
    /// Standard deviation of the white noise of the even samples; 0 where there is none.
    pub noise: f64,
    /// Step of the even samples; 0 where they have none.
    pub step: f64,
    /// What the column holds where that is no number.
    pub other: Option<String>,
}

impl Signal {
    /// Factor from the file's unit to SI.
    pub fn factor(&self) -> f64 {
        self.stated.or(self.hint).map_or(1.0, |unit| unit.factor)
    }
}

/// One recording.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    /// The file by its given name, with the episode of a dataset.
    pub file: String,
    /// Its streams.
    pub streams: Vec<Stream>,
    /// Its signals, without the times.
    pub signals: Vec<Signal>,
    /// The column of the times and its unit in words; `None` where a rate or stamps stand for it.
    pub time: Option<String>,
    /// Step of the even clock, s.
    pub period: f64,
    /// What a person should know of the file.
    pub notes: Vec<String>,
}

impl Recording {
    /// Samples per second of the even clock, Hz.
    pub fn rate(&self) -> f64 {
        1.0 / self.period
    }

    /// The stream of a signal.
    pub fn stream(&self, signal: &Signal) -> &Stream {
        &self.streams[signal.stream]
    }
}
