//! The rows of a table, and its columns.

use crate::answered::Answered;
use crate::date::Date;
use crate::manifest::Entry;
use crate::parameter;
use crate::what::What;
use std::collections::{BTreeMap, BTreeSet};

/// Columns that every table has, texts.
pub const TEXTS: [&str; 6] = ["recording", "unit", "joint", "date", "answer", "error"];
/// Columns that every table has, numbers.
pub const NUMBERS: [&str; 3] = ["time", "temperature", "since_start"];

/// The table of a fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// What was asked.
    pub what: What,
    /// The rows.
    pub rows: Vec<TableRow>,
}

/// A row: a recording and a joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TableRow {
    /// The recording.
    pub recording: String,
    /// The unit.
    pub unit: String,
    /// The joint; empty where there is no answer.
    pub joint: String,
    /// When it was recorded.
    pub date: Option<Date>,
    /// Temperature, °C.
    pub temperature: Option<f64>,
    /// Time since the start of the device, s.
    pub since_start: Option<f64>,
    /// The key of the answer: its verdict is `verdicts/KEY.json`.
    pub answer: String,
    /// Why there is no answer; empty where there is one.
    pub error: String,
    /// Further numbers by column.
    pub numbers: BTreeMap<String, f64>,
    /// Further texts by column.
    pub words: BTreeMap<String, String>,
}

impl Table {
    /// Without rows.
    pub fn new(what: What) -> Table {
        Table { what, rows: Vec::new() }
    }

    /// Adds the answer to a recording.
    pub fn add(&mut self, entry: &Entry, key: &str, answered: &Answered) {
        for row in &answered.rows {
            self.rows.push(TableRow {
                recording: entry.name.clone(),
                unit: entry.unit.clone(),
                joint: row.joint.clone(),
                date: entry.date,
                temperature: entry.temperature,
                since_start: entry.since_start,
                answer: key.to_string(),
                error: answered.error.clone().unwrap_or_default(),
                numbers: row.numbers.clone(),
                words: row.words.clone(),
            });
        }
    }

    /// Names of the further columns of numbers: parameters first, then the others by name.
    pub fn number_columns(&self) -> Vec<String> {
        let there: BTreeSet<&String> = self.rows.iter().flat_map(|row| row.numbers.keys()).collect();
        let first: Vec<String> = parameter::ALL.iter().flat_map(|p| [p.name.to_string(), format!("{}_sd", p.name)]).collect();
        let mut out: Vec<String> = first.iter().filter(|name| there.contains(name)).cloned().collect();
        out.extend(there.into_iter().filter(|name| !first.contains(name)).cloned());
        out
    }

    /// Names of the further columns of texts.
    pub fn word_columns(&self) -> Vec<String> {
        self.rows.iter().flat_map(|row| row.words.keys().cloned()).collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// The units, in order.
    pub fn units(&self) -> Vec<&str> {
        self.rows.iter().map(|row| row.unit.as_str()).collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// The joints, in the order of the first row that has each.
    pub fn joints(&self) -> Vec<&str> {
        let mut out: Vec<&str> = Vec::new();
        for row in self.rows.iter().filter(|row| !row.joint.is_empty()) {
            if !out.contains(&row.joint.as_str()) {
                out.push(&row.joint);
            }
        }
        out
    }
}

impl TableRow {
    /// A parameter with its standard error, where both were estimated.
    pub fn estimate(&self, parameter: &str) -> Option<(f64, f64)> {
        let value = *self.numbers.get(parameter)?;
        let sd = *self.numbers.get(&format!("{parameter}_sd"))?;
        (value.is_finite() && sd.is_finite() && sd >= 0.0).then_some((value, sd))
    }

    /// Whether the joint was recorded by commands and positions.
    pub fn is_servo(&self) -> bool {
        self.words.get("kind").is_some_and(|kind| kind == "servo")
    }
}
