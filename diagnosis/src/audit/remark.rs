//! The content of a check's remark, and the recordings and the signal it refers to.

use crate::recordings::problem::Record;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Weight {
    /// Good to know.
    Note,
    /// Limits what can be claimed.
    Caution,
    /// Nothing can be claimed of this signal.
    Unusable,
}

/// A finding about recordings or one of their signals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Remark {
    /// How much it matters.
    pub weight: Weight,
    /// The recordings, by file name; empty where it is about all of them.
    pub records: Vec<String>,
    /// The signal; empty where it is about the clock.
    pub signal: String,
    /// What was looked at: `clock`, `gaps`, `short`, `missing`, `constant`, `outliers`, `encoder`, `filtered`, `saturated`, `sign`, `unit`, `loop`,
    /// `repeats`, `noise`, `timing`, `hold`, `thinned`, `velocity`.
    pub about: &'static str,
    /// One clause; of several recordings that of the first.
    pub text: String,
}

impl Remark {
    /// Where it is: files, signal, or `all recordings`.
    pub fn place(&self) -> String {
        let files = match self.records.as_slice() {
            [] if self.signal.is_empty() => "all recordings".to_string(),
            [] => String::new(),
            [one] => one.clone(),
            [one, two] => format!("{one} and {two}"),
            [one, rest @ ..] => format!("{one} and {} more", rest.len()),
        };
        match (files.is_empty(), self.signal.is_empty()) {
            (true, _) => self.signal.clone(),
            (false, true) => files,
            (false, false) => format!("{} in {files}", self.signal),
        }
    }
}

impl std::fmt::Display for Remark {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}: {}", self.place(), self.text)
    }
}

/// A remark about one recording.
pub(super) fn add(all: &mut Vec<Remark>, weight: Weight, record: &Record, signal: &str, about: &'static str, text: String) {
    all.push(Remark { weight, records: vec![file_name(&record.name).to_string()], signal: signal.to_string(), about, text });
}

/// The last part of a path.
pub(crate) fn file_name(path: &str) -> &str {
    path.rsplit('/').find(|part| !part.is_empty()).unwrap_or(path)
}

/// What is the same in several recordings, said once; in all of `count`, without their names.
pub(super) fn merged(all: Vec<Remark>, count: usize) -> Vec<Remark> {
    let mut out: Vec<Remark> = Vec::new();
    for remark in all {
        match out.iter_mut().find(|r| (r.weight, &r.signal, r.about) == (remark.weight, &remark.signal, remark.about)) {
            Some(same) => same.records.extend(remark.records),
            None => out.push(remark),
        }
    }
    for remark in &mut out {
        remark.records.dedup();
        if remark.records.len() == count && count > 1 {
            remark.records.clear();
        }
    }
    out
}
