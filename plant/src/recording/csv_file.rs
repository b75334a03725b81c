//! CSV recordings.

use super::columns::{Cell, Columns, Piece};
use super::headings::Headings;
use super::record::Recording;
use super::rows::{Rows, gather};
use super::text_table::{TextTable, comma_remark};
use crate::tomlfile::{self, FileError};
use csv::StringRecord;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// The headings of a CSV file, as they stand there: `name` or `name [unit]`.
///
/// # Errors
/// When the file cannot be read or has no heading.
pub fn read_headings(path: &Path) -> Result<Vec<String>, FileError> {
    let name = path.display().to_string();
    let file = crate::input_file::open(path).map_err(|e| tomlfile::unreadable(path, &e))?;
    let mut table = TextTable::new(BufReader::new(file)).map_err(|e| tomlfile::unreadable(path, &e))?;
    Ok(heading_of(&mut table, &name)?.1.iter().map(str::to_string).collect())
}

/// The error for a table whose first row holds numbers.
pub const NO_HEADING: &str = "there is no heading: expected names of columns such as t,force,position, found numbers. \
     Add one, or name the columns of `backdrive bag import` or `backdrive init` with --columns t,force,position (and --rate HZ if no column is the \
     time). A line that begins with # is a comment";

/// Whether a table's first row holds numbers, which are no names of columns.
pub fn is_no_heading<'a>(cells: impl Iterator<Item = &'a str>) -> bool {
    let mut named = cells.filter(|cell| !cell.is_empty()).peekable();
    named.peek().is_some() && named.all(|cell| cell.parse::<f64>().is_ok())
}

/// The heading, and its line.
fn heading_of<R: BufRead>(table: &mut TextTable<R>, name: &str) -> Result<(usize, StringRecord), FileError> {
    let mut heading = StringRecord::new();
    let line = table.next(&mut heading).map_err(|(line, what)| FileError::at(name, line as usize, "", what))?;
    let line = line.unwrap_or(1) as usize;
    if heading.iter().all(str::is_empty) {
        return Err(FileError::at(name, line, "", "is empty, expected a heading such as t,force,position"));
    }
    match is_no_heading(heading.iter()) {
        true => Err(FileError::at(name, line, "", NO_HEADING)),
        false => Ok((line, heading)),
    }
}

/// Reads the named signals of a CSV file, or all of its columns where `signals` is `None`.
///
/// Cells are separated by commas, semicolons, tabs or spaces. The first line is the heading, `name` or `name [unit]`; time is the column `t` unless
/// `columns` names another. A unit that `columns` names goes before one in the heading, and so does a scale. Samples are in SI units. Cells of other
/// columns are not looked at. A cell that is no finite number, or a time that does not rise, is an error at its line.
pub fn read_csv(path: &Path, signals: Option<&[&str]>, columns: &Columns, piece: &Piece) -> Result<Recording, FileError> {
    let name = path.display().to_string();
    let text = tomlfile::read_text(path)?;
    let mut table = TextTable::new(text.as_bytes()).map_err(|e| tomlfile::unreadable(path, &e))?;
    let (heading_line, headings) = heading_of(&mut table, &name)?;
    let headings: Vec<String> = headings.iter().map(str::to_string).collect();
    let mut rows = TextRows { name: &name, table, row: StringRecord::new() };
    gather(&Headings { name: &name, line: heading_line, headings: &headings }, &mut rows, signals, columns, piece)
}

/// The rows of a CSV file.
struct TextRows<'a, R> {
    name: &'a str,
    table: TextTable<R>,
    row: StringRecord,
}

impl<R: BufRead> Rows for TextRows<'_, R> {
    fn next(&mut self) -> Result<Option<usize>, FileError> {
        let next = self.table.next(&mut self.row).map_err(|(line, what)| FileError::at(self.name, line as usize, "", what))?;
        Ok(next.map(|line| line as usize))
    }

    fn number(&self, column: usize) -> Result<f64, String> {
        let cell = &self.row[column];
        cell.parse().map_err(|_| if cell.is_empty() { "an empty cell".into() } else { format!("\"{cell}\"{}", comma_remark(cell)) })
    }

    fn holds(&self, column: usize, cell: &Cell) -> bool {
        cell.matches(&self.row[column])
    }

    fn shown(&self, column: usize) -> String {
        self.row[column].to_string()
    }
}

/// Writes a recording as CSV: `t` first, then its signals; every number reads back as the same number.
pub fn write_csv(recording: &Recording, path: &Path) -> Result<(), FileError> {
    let name = path.display().to_string();
    let failed = |e: csv::Error| FileError::whole(&name, format!("cannot be written: {e}"));
    let mut writer = csv::Writer::from_path(path).map_err(failed)?;
    writer.write_record(std::iter::once("t").chain(recording.signals.iter().map(|s| s.0.as_str()))).map_err(failed)?;
    for (i, t) in recording.t.iter().enumerate() {
        let values = recording.signals.iter().map(|s| s.1.get(i).copied().unwrap_or(f64::NAN));
        let row = std::iter::once(*t).chain(values).map(|x| format!("{x:?}"));
        writer.write_record(row).map_err(failed)?;
    }
    writer.flush().map_err(|e| FileError::whole(&name, format!("cannot be written: {e}")))
}
