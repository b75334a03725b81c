//! A table as any reader gives it and any writer takes it.

use crate::BagError;
use crate::number_type::{LARGEST_WHOLE, NumberType};
use backdrive_plant::recording::units::{self, Unit};
use std::path::Path;

/// The unit that a heading names, where it is known.
pub(crate) fn unit_of(heading: &str) -> Option<Unit> {
    units::split(heading).1.and_then(|unit| units::parse(unit).ok())
}

/// What a column is called in the bag: its heading without the unit, where that is known.
pub(crate) fn name_of(heading: &str) -> &str {
    unit_of(heading).map_or(heading, |_| units::split(heading).0)
}

/// Columns of equal length, in the order of their file.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Table {
    /// All columns, those without numbers too.
    pub(crate) columns: Vec<Column>,
    /// What else a person should know of the file: a sentence each.
    pub(crate) notes: Vec<String>,
    /// Of text, in which lines it stands.
    pub(crate) lines: Option<Lines>,
}

/// Lines of a file of text, from 1.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Lines {
    pub(crate) heading: u64,
    pub(crate) rows: Vec<u64>,
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
    /// Rows with numbers.
    pub(crate) fn len(&self) -> usize {
        match self {
            Cells::Numbers(values, _) => values.len(),
            Cells::Large { values, .. } => values.len(),
            Cells::Other(_) => 0,
        }
    }

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
        self.columns.first().map_or(0, |column| column.cells.len())
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

    /// The place of the column with this heading, else of the one that is called so without its unit.
    pub(crate) fn find(&self, path: &Path, asked: &str) -> Result<Option<usize>, BagError> {
        let of = |is: &dyn Fn(&Column) -> bool| (0..self.columns.len()).filter(|place| is(&self.columns[*place])).collect::<Vec<_>>();
        let exact = of(&|column| column.name == asked);
        let found = if exact.is_empty() { of(&|column| name_of(&column.name) == asked) } else { exact };
        match found.as_slice() {
            [_, _, ..] => Err(self.wrong_columns(path, format!("two columns are called {asked:?}; give one another heading"))),
            found => Ok(found.first().copied()),
        }
    }

    /// An error that lists the columns in place of the one that is not there.
    pub(crate) fn no_column(&self, path: &Path, asked: &str, advice: &str) -> BagError {
        let (mut numbers, mut others) = (Vec::new(), Vec::new());
        for column in &self.columns {
            let of = if matches!(column.cells, Cells::Other(_)) { &mut others } else { &mut numbers };
            of.push(name_of(&column.name));
        }
        let what = if self.columns.iter().all(|column| column.name.is_empty()) {
            "is empty, expected a heading such as t,force,position".to_owned()
        } else if numbers.is_empty() {
            format!("there is no column {asked:?}, and none with numbers; there is {}", others.join(", "))
        } else {
            format!("there is no column {asked:?}; there is {}{advice}", numbers.join(", "))
        };
        self.wrong_columns(path, what)
    }

    /// An error at a row (from 0), counted as a person counts in such a file.
    pub(crate) fn wrong(&self, path: &Path, row: usize, what: String) -> BagError {
        match &self.lines {
            Some(lines) => BagError::Table { path: path.to_owned(), line: lines.rows.get(row).copied().unwrap_or(lines.heading), what },
            None => BagError::File { path: path.to_owned(), what: format!("row {}: {what}", row + 1) },
        }
    }

    /// An error about its columns as such.
    pub(crate) fn wrong_columns(&self, path: &Path, what: String) -> BagError {
        match &self.lines {
            Some(lines) => BagError::Table { path: path.to_owned(), line: lines.heading, what },
            None => BagError::File { path: path.to_owned(), what },
        }
    }
}
