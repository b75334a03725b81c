//! Tables as CSV.

use super::mapping::ImportOptions;
use super::to_bag::name_of;
use super::types::{Cells, Column, Table};
use crate::BagError;
use crate::number_type::NumberType;
use backdrive_plant::recording::separator_of;
use std::path::Path;

/// Reads a CSV file, whose cells are separated by commas, semicolons, tabs or spaces. A column with a cell that is no number holds none, unless it is asked for: then that is an error, as is an empty cell or `nan`.
pub(crate) fn read(path: &Path, options: &ImportOptions) -> Result<Table, BagError> {
    let wrong = |line: u64, what: String| BagError::Table { path: path.to_owned(), line, what };
    let failed = |error: csv::Error| {
        let line = error.position().map_or(1, csv::Position::line);
        wrong(line, error.to_string())
    };
    let file = std::fs::File::open(path).map_err(BagError::io(path))?;
    // What comes through a pipe cannot be looked at before it is read.
    let separator = if path.is_file() { separator_of(path) } else { b',' };
    let mut csv =
        csv::ReaderBuilder::new().delimiter(separator).trim(csv::Trim::All).comment(Some(b'#')).from_reader(std::io::BufReader::new(file));
    let headings: Vec<String> =
        csv.headers().map_err(failed)?.iter().map(|heading| heading.trim_start_matches('\u{feff}').to_owned()).collect();
    let mut columns: Vec<Option<Vec<f64>>> = vec![Some(Vec::new()); headings.len()];
    let needed = |heading: &str| heading == options.time || options.columns.iter().any(|map| map.column == heading);
    let mut record = csv::StringRecord::new();
    while csv.read_record(&mut record).map_err(failed)? {
        for ((cell, column), heading) in record.iter().zip(&mut columns).zip(&headings) {
            let Some(values) = column else { continue };
            let heading = name_of(heading, options);
            let line = || record.position().map_or(0, csv::Position::line);
            match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => values.push(value),
                Ok(_) => {
                    return Err(wrong(line(), format!("column {heading:?}: expected a number, found {cell:?}; leave such rows out")));
                }
                Err(_) if cell.is_empty() && !values.is_empty() => {
                    return Err(wrong(line(), format!("column {heading:?}: expected a number, found an empty cell; leave such rows out")));
                }
                Err(_) if needed(heading) => return Err(wrong(line(), format!("column {heading:?}: {cell:?} is not a number"))),
                Err(_) => *column = None,
            }
        }
    }
    let column = |(name, values): (String, Option<Vec<f64>>)| match values {
        Some(values) => Column::new(name, values, NumberType::Double),
        None => Column::other(name, "something that is no number"),
    };
    Ok(Table { columns: headings.into_iter().zip(columns).map(column).collect(), notes: Vec::new(), is_text: true })
}

/// Writes a table; numbers have the shortest digits that read back to the same bits, and what was not measured is `nan`.
pub(crate) fn write(table: &Table, out: &Path) -> Result<(), BagError> {
    let file = std::fs::File::create_new(out).map_err(BagError::io(out))?;
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
    csv.flush().map_err(BagError::io(out))
}

fn digits(value: f64, of: NumberType) -> String {
    match of {
        _ if value.is_nan() => "nan".to_owned(),
        // Single precision has shorter digits that read back to the same number, but only as single.
        NumberType::Double | NumberType::Single => format!("{value:?}"),
        _ => format!("{value:.0}"),
    }
}
