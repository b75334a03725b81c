//! Tables as CSV.

use super::mapping::ImportOptions;
use super::types::{Cells, Column, Lines, Table, name_of};
use crate::BagError;
use crate::memory::Memory;
use crate::number_type::NumberType;
use backdrive_plant::recording::{NO_HEADING, TextTable, comma_remark, is_no_heading};
use std::path::Path;

/// Reads a CSV file, whose cells are separated by commas, semicolons, tabs or spaces. A column with a cell that is no number holds none, unless it is
/// requested. Then that is an error, as is an empty cell or `nan` of a column that goes into the bag.
pub(crate) fn read(path: &Path, options: &ImportOptions) -> Result<Table, BagError> {
    read_cells(path, options, Missing::IsWrong)
}

/// What becomes of an empty cell, or one that holds `nan` or `inf`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Missing {
    /// It is an error where the column is wanted.
    IsWrong,
    /// It stays as a value that is not finite.
    Stays,
}

/// As [`read`], with what becomes of missing values.
pub(crate) fn read_cells(path: &Path, options: &ImportOptions, missing: Missing) -> Result<Table, BagError> {
    let wrong = |(line, what): (u64, String)| BagError::Table { path: path.to_owned(), line, what };
    let file = backdrive_plant::input_file::open(path).map_err(BagError::io(path))?;
    let mut table = TextTable::new(std::io::BufReader::new(file)).map_err(BagError::io(path))?;
    let mut record = csv::StringRecord::new();
    let first = table.next(&mut record).map_err(wrong)?;
    let heading = first.unwrap_or(1);
    let mut columns: Vec<Read> = match &options.headings {
        None if is_no_heading(record.iter()) => return Err(wrong((heading, NO_HEADING.to_owned()))),
        None => record.iter().map(|heading| Read::new(heading, options, missing)).collect(),
        Some(names) => {
            named(names, &record).map_err(|what| wrong((heading, what)))?;
            names.iter().map(|name| Read::new(name, options, missing)).collect()
        }
    };
    let (mut lines, memory) = (Vec::new(), Memory::new(options.most_bytes));
    // The first row is a heading unless the headings were given.
    let mut next = first.filter(|_| options.headings.is_some());
    while let Some(line) = next.take().map_or_else(|| table.next(&mut record), |line| Ok(Some(line))).map_err(wrong)? {
        memory.take_numbers(record.len() as u64 + 1).map_err(|what| wrong((line, what)))?;
        lines.push(line);
        for (cell, column) in record.iter().zip(&mut columns) {
            column.take(line, cell).map_err(|what| wrong((line, what)))?;
        }
    }
    Ok(Table { columns: columns.into_iter().map(Read::column).collect(), notes: Vec::new(), lines: Some(Lines { heading, rows: lines }) })
}

/// Whether a table without a heading can have these names.
fn named(names: &[String], first: &csv::StringRecord) -> Result<(), String> {
    if !first.is_empty() && !first.iter().any(|cell| cell.parse::<f64>().is_ok()) {
        let there = first.iter().collect::<Vec<_>>().join(", ");
        return Err(format!("the table has a heading already ({there}); leave --columns out"));
    }
    match first.len() == names.len() {
        true => Ok(()),
        false => Err(format!("--columns names {} columns ({}), and the table has {}", names.len(), names.join(", "), first.len())),
    }
}

/// A column that is being read.
struct Read {
    heading: String,
    /// What it is called in the bag.
    name: String,
    /// It goes into the bag if it holds numbers.
    is_wanted: bool,
    /// Somebody asked for it: it has to hold numbers.
    is_asked_for: bool,
    values: Vec<f64>,
    /// What of it is no number, once there is something.
    other: Option<String>,
}

impl Read {
    fn new(heading: &str, options: &ImportOptions, missing: Missing) -> Read {
        let name = name_of(heading).to_owned();
        let is = |asked: &str| asked == name || asked == heading;
        let is_asked_for = is(&options.time) || options.columns.iter().any(|map| is(&map.column));
        let is_wanted = missing == Missing::IsWrong && (is_asked_for || options.columns.is_empty());
        Read { heading: heading.to_owned(), name, is_wanted, is_asked_for, values: Vec::new(), other: None }
    }

    fn take(&mut self, line: u64, cell: &str) -> Result<(), String> {
        if self.other.is_some() {
            return Ok(());
        }
        let shown = if cell.is_empty() { "an empty cell".to_owned() } else { format!("{cell:?}") };
        match cell.parse::<f64>() {
            Ok(value) if value.is_finite() || !self.is_wanted => self.values.push(value),
            Err(_) if cell.is_empty() && !self.is_wanted => self.values.push(f64::NAN),
            Err(_) if !cell.is_empty() && self.is_asked_for => {
                return Err(format!("column {:?}: {shown} is not a number{}", self.name, comma_remark(cell)));
            }
            Err(_) if !cell.is_empty() || (self.values.is_empty() && !self.is_asked_for) => {
                self.values = Vec::new();
                self.other = Some(format!("something that is not a number, first in line {line}: {shown}{},", comma_remark(cell)));
            }
            _ => {
                let advice = "leave such rows out, or name the columns that count with --map";
                return Err(format!("column {:?}: expected a number, found {shown}; {advice}", self.name));
            }
        }
        Ok(())
    }

    fn column(self) -> Column {
        match self.other {
            Some(other) => Column::other(self.heading, other),
            None => Column::new(self.heading, self.values, NumberType::Double),
        }
    }
}

/// Writes a table; numbers have the shortest digits that read back to the same bits, and what was not measured is `nan`.
pub(crate) fn write(table: &Table, out: &Path) -> Result<(), BagError> {
    let file = std::fs::File::create_new(out).map_err(BagError::create(out))?;
    let mut csv = csv::Writer::from_writer(std::io::BufWriter::new(file));
    let failed = |error: csv::Error| BagError::Write { name: out.display().to_string(), what: error.to_string() };
    csv.write_record(table.columns.iter().map(|column| &column.name)).map_err(failed)?;
    let columns: Vec<(&[f64], NumberType)> = table
        .columns
        .iter()
        .filter_map(|column| match &column.cells {
            Cells::Numbers(values, of) => Some((values.as_slice(), *of)),
            _ => None,
        })
        .collect();
    let mut row: Vec<String> = Vec::with_capacity(columns.len());
    for index in 0..columns.first().map_or(0, |(values, _)| values.len()) {
        row.clear();
        row.extend(columns.iter().map(|(values, of)| digits(values[index], *of)));
        csv.write_record(&row).map_err(failed)?;
    }
    csv.flush().map_err(BagError::create(out))
}

fn digits(value: f64, of: NumberType) -> String {
    match of {
        _ if value.is_nan() => "nan".to_owned(),
        // Single precision has shorter digits that read back to the same number, but only as single.
        NumberType::Double | NumberType::Single => format!("{value:?}"),
        _ => format!("{value:.0}"),
    }
}
