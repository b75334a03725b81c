//! Columns in memory, as a program hands them over.

use super::columns::{Cell, Columns, Piece};
use super::headings::Headings;
use super::record::Recording;
use super::rows::{Rows, gather};
use crate::tomlfile::FileError;

/// A table in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    name: String,
    headings: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Frame {
    /// Columns with their headings, `name` or `name [unit]`; `name` stands for the table in errors. NaN is a missing value.
    ///
    /// # Errors
    /// There is no column, or the columns differ in length.
    pub fn new(name: impl Into<String>, columns: Vec<(String, Vec<f64>)>) -> Result<Frame, FileError> {
        let name = name.into();
        let Some(rows) = columns.first().map(|(_, column)| column.len()) else {
            return Err(FileError::whole(name, "has no columns"));
        };
        if let Some((heading, column)) = columns.iter().find(|(_, column)| column.len() != rows) {
            return Err(FileError::whole(name, format!("\"{heading}\" has {} samples, the first column has {rows}", column.len())));
        }
        let (headings, columns) = columns.into_iter().unzip();
        Ok(Frame { name, headings, columns })
    }

    /// What stands for it in errors.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its headings.
    pub fn headings(&self) -> &[String] {
        &self.headings
    }

    /// Its columns with their headings.
    pub fn into_columns(self) -> Vec<(String, Vec<f64>)> {
        self.headings.into_iter().zip(self.columns).collect()
    }

    /// Whether both hold the same numbers under the same headings, bit for bit.
    pub fn is_same_data(&self, other: &Frame) -> bool {
        let same = |(a, b): (&Vec<f64>, &Vec<f64>)| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        self.headings == other.headings && self.columns.iter().zip(&other.columns).all(same)
    }

    /// The named signals, or all columns where `signals` is `None`, as from a file; lines of errors are counted with the heading as the first one.
    pub(super) fn read(&self, signals: Option<&[&str]>, columns: &Columns, piece: &Piece) -> Result<Recording, FileError> {
        let headings = Headings { name: &self.name, line: 1, headings: &self.headings };
        gather(&headings, &mut FrameRows { frame: self, next: 0 }, signals, columns, piece)
    }
}

/// The rows of a frame.
struct FrameRows<'a> {
    frame: &'a Frame,
    /// The row that comes next, from 0.
    next: usize,
}

impl FrameRows<'_> {
    fn value(&self, column: usize) -> f64 {
        self.frame.columns[column][self.next - 1]
    }
}

impl Rows for FrameRows<'_> {
    fn next(&mut self) -> Result<Option<usize>, FileError> {
        let is_there = self.next < self.frame.columns.first().map_or(0, Vec::len);
        self.next += 1;
        Ok(is_there.then_some(self.next + 1))
    }

    fn number(&self, column: usize) -> Result<f64, String> {
        Ok(self.value(column))
    }

    fn holds(&self, column: usize, cell: &Cell) -> bool {
        cell.matches(&self.shown(column))
    }

    fn shown(&self, column: usize) -> String {
        format!("{:?}", self.value(column))
    }
}
