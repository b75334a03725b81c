//! What is inspected, and how it is read.

use backdrive_bags::BagError;
use std::path::PathBuf;
use thiserror::Error;

/// A recording, or several.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// A table (CSV, parquet, MAT, npz), an MCAP bag, a LeRobot dataset, or a folder of these.
    Path(PathBuf),
    /// Columns in memory, of equal length: a name for messages, and headings with their values.
    Columns {
        /// What the recording is called in messages.
        name: String,
        /// Headings, which may name units, with values.
        columns: Vec<(String, Vec<f64>)>,
    },
}

/// How recordings are read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Rows per second of tables in which no column is the time, Hz.
    pub rate_hz: Option<f64>,
    /// Headings of tables that have none, in their order; a heading may name its unit, `q (deg)`.
    pub columns: Option<Vec<String>>,
    /// Heading of the column with the times; found from names and data without it.
    pub time: Option<String>,
}

/// Why a recording could not be inspected.
#[derive(Debug, Error)]
pub enum InspectError {
    /// A file cannot be read.
    #[error("{0}")]
    Bag(#[from] BagError),
    /// A file is read, but there is nothing in it that can be inspected.
    #[error("{file}: {what}")]
    Recording {
        /// The file.
        file: String,
        /// What is wrong with it, and what to do.
        what: String,
    },
}

impl InspectError {
    /// A recording that cannot be inspected.
    pub(crate) fn of(file: &str, what: impl Into<String>) -> InspectError {
        InspectError::Recording { file: file.to_string(), what: what.into() }
    }
}
