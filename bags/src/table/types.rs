//! A table as any reader gives it and any writer takes it.

use crate::BagError;
use crate::number_type::{LARGEST_WHOLE, NumberType};
use std::path::Path;

/// Columns of equal length, in the order of their file.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Table {
    /// All columns, those without numbers too.
    pub(crate) columns: Vec<Column>,
    /// What else a person should know of the file: a sentence each.
    pub(crate) notes: Vec<String>,
    /// Whether it is text, whose places are lines; the heading is the first.
    pub(crate) is_text: bool,
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Column {
    /// Its heading, with the unit that it may name.
    pub(crate) name: String,
    /// What stands below.
    pub(crate) cells: Cells,
}

/// What stands in a column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Cells {
    /// Numbers, and what they are in the file; NaN where there is none.
    Numbers(Vec<f64>, NumberType),
    /// Whole numbers that no double holds, such as ns since 1970. Where they are instants, how many make a second.
    Large {
        /// One a row.
        values: Vec<i64>,
        /// Of instants, how many make a second.
        per_second: Option<f64>,
    },
    /// No numbers; what there is, as in "column x holds ...".
    Other(String),
}

impl Cells {
    /// Whole numbers of 64 bits: as doubles where all are exactly that.
    pub(crate) fn of_whole(values: Vec<i64>, of: NumberType) -> Cells {
        match values.iter().all(|value| value.unsigned_abs() as f64 <= LARGEST_WHOLE) {
            true => Cells::Numbers(values.into_iter().map(|value| value as f64).collect(), of),
            false => Cells::Large { values, per_second: None },
        }
    }
}

impl Column {
    /// A column of numbers.
    pub(crate) fn new(name: impl Into<String>, values: Vec<f64>, of: NumberType) -> Column {
        Column { name: name.into(), cells: Cells::Numbers(values, of) }
    }

    /// One that holds something else, as in "column x holds ...".
    pub(crate) fn other(name: impl Into<String>, holds: impl Into<String>) -> Column {
        Column { name: name.into(), cells: Cells::Other(holds.into()) }
    }
}

impl Table {
    /// Rows of its first column.
    pub(crate) fn rows(&self) -> usize {
        match self.columns.first().map(|column| &column.cells) {
            Some(Cells::Numbers(values, _)) => values.len(),
            Some(Cells::Large { values, .. }) => values.len(),
            _ => 0,
        }
    }

    /// Takes the first row off.
    pub(crate) fn drop_first_row(&mut self) {
        for column in &mut self.columns {
            match &mut column.cells {
                Cells::Numbers(values, _) if !values.is_empty() => drop(values.remove(0)),
                Cells::Large { values, .. } if !values.is_empty() => drop(values.remove(0)),
                _ => {}
            }
        }
    }

    /// An error at a row (from 0), told as a person counts in such a file.
    pub(crate) fn wrong(&self, path: &Path, row: usize, what: String) -> BagError {
        match self.is_text {
            true => BagError::Table { path: path.to_owned(), line: row as u64 + 2, what },
            false => BagError::File { path: path.to_owned(), what: format!("row {}: {what}", row + 1) },
        }
    }

    /// An error about its columns as such.
    pub(crate) fn wrong_columns(&self, path: &Path, what: String) -> BagError {
        match self.is_text {
            true => BagError::Table { path: path.to_owned(), line: 1, what },
            false => BagError::File { path: path.to_owned(), what },
        }
    }
}
