//! A table, wherever it is: a CSV file, or columns in memory.

use super::columns::{Columns, Piece};
use super::csv_file::{read_csv, read_headings};
use super::frame::Frame;
use super::record::{Recording, signals_of};
use super::units;
use crate::model::Model;
use crate::tomlfile::FileError;
use std::path::PathBuf;
use std::sync::Arc;

/// Where a table is.
#[derive(Debug, Clone, PartialEq)]
pub enum TableSource {
    /// A CSV file.
    File(PathBuf),
    /// Columns that a program holds.
    Frame(Arc<Frame>),
}

impl TableSource {
    /// What stands for it in errors.
    pub fn name(&self) -> String {
        match self {
            TableSource::File(path) => path.display().to_string(),
            TableSource::Frame(frame) => frame.name().to_string(),
        }
    }

    /// Its headings: `name` or `name [unit]`.
    ///
    /// # Errors
    /// When the file cannot be read or has no heading.
    pub fn headings(&self) -> Result<Vec<String>, FileError> {
        match self {
            TableSource::File(path) => read_headings(path),
            TableSource::Frame(frame) => Ok(frame.headings().to_vec()),
        }
    }

    /// Reads the named signals, or all columns where `signals` is `None`; see [`read_csv`].
    ///
    /// # Errors
    /// As [`read_csv`].
    pub fn read(&self, signals: Option<&[&str]>, columns: &Columns, piece: &Piece) -> Result<Recording, FileError> {
        match self {
            TableSource::File(path) => read_csv(path, signals, columns, piece),
            TableSource::Frame(frame) => frame.read(signals, columns, piece),
        }
    }

    /// Reads the signals of a model: its inputs, and those of its outputs that were recorded. Other columns may hold anything.
    ///
    /// Where an input is missing that `may_be_absent` does not excuse, all columns are read, so that the caller can list what there is.
    ///
    /// # Errors
    /// As [`read_csv`].
    pub fn read_signals_of(
        &self,
        model: &Model,
        columns: &Columns,
        piece: &Piece,
        may_be_absent: &dyn Fn(&str) -> bool,
    ) -> Result<Recording, FileError> {
        // An error of the whole file is reported by the code that reads the whole file.
        let Ok(headings) = self.headings() else { return self.read(None, columns, piece) };
        let there = |signal: &str| {
            columns.iter().any(|(ruled, _)| ruled == signal) || headings.iter().any(|h| h == signal || units::split(h).0 == signal)
        };
        let needed = |name: &str| model.inputs.iter().any(|input| input.name == name) && !may_be_absent(name);
        let wanted: Vec<&str> = signals_of(model).into_iter().filter(|signal| there(signal)).collect();
        if signals_of(model).into_iter().all(|signal| there(signal) || !needed(signal)) {
            return self.read(Some(&wanted), columns, piece);
        }
        // Where a column of words prevents reading all, the missing one is reported.
        let with_missing: Vec<&str> = signals_of(model).into_iter().filter(|signal| there(signal) || needed(signal)).collect();
        self.read(None, columns, piece).or_else(|_| self.read(Some(&with_missing), columns, piece))
    }
}
