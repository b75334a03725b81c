//! From the rows of a table to a recording, whether they stand in a file or in memory.

use super::columns::{Cell, Columns, Piece};
use super::headings::{Headings, Wanted};
use super::record::{LARGEST, Recording, RecordingError};
use super::units::Kind;
use crate::tomlfile::FileError;

/// The rows of a table, one after another.
pub(super) trait Rows {
    /// Goes on to the next row, and gives the line that it stands in; `None` at the end.
    fn next(&mut self) -> Result<Option<usize>, FileError>;
    /// The number of a cell of this row; else what stands there, as in "expected a number, found ...".
    fn number(&self, column: usize) -> Result<f64, String>;
    /// Whether a cell of this row has a value.
    fn holds(&self, column: usize, cell: &Cell) -> bool;
    /// The text of a cell of this row.
    fn shown(&self, column: usize) -> String;
}

/// Gathers the named signals, or all columns where `signals` is `None`.
pub(super) fn gather(
    headings: &Headings,
    rows: &mut impl Rows,
    signals: Option<&[&str]>,
    columns: &Columns,
    piece: &Piece,
) -> Result<Recording, FileError> {
    let name = headings.name;
    let time = headings.find("t", columns)?;
    let time = headings.timed(time, columns)?;
    if let Some(unit) = time.unit.filter(|unit| unit.kind != Kind::Time) {
        return Err(FileError::at(
            name,
            headings.line,
            &time.heading,
            format!("is in {}, {}, expected a time such as s or ms", unit.name, unit.kind.text()),
        ));
    }
    let wanted = match signals {
        Some(signals) => signals.iter().map(|s| headings.find(s, columns)).collect::<Result<Vec<_>, _>>()?,
        None => headings.all(columns, &time)?,
    };
    let chosen = piece
        .keep
        .iter()
        .map(|(column, cell)| Ok((headings.index_of(column, column, "where")?, cell)))
        .collect::<Result<Vec<_>, FileError>>()?;

    let mut t = Vec::new();
    let mut lines = Vec::new();
    let mut samples = vec![Vec::new(); wanted.len()];
    let mut row = 0;
    let [from, to] = piece.rows.unwrap_or([0, usize::MAX]);
    loop {
        let next = if row >= to { None } else { rows.next()? };
        let Some(line) = next else { break };
        row += 1;
        if row <= from || !chosen.iter().all(|(index, cell)| rows.holds(*index, cell)) {
            continue;
        }
        t.push(number(name, line, rows, &time)?);
        lines.push(line);
        for (column, values) in wanted.iter().zip(&mut samples) {
            values.push(number(name, line, rows, column)?);
        }
    }
    if piece.rows.is_some() && row < to {
        return Err(FileError::whole(name, format!("rows [{from}, {to}] reach beyond its {row} rows of data")));
    }
    if t.is_empty() && !piece.keep.is_empty() {
        return Err(FileError::whole(name, "no row has the values that where asks for"));
    }
    let units = wanted.iter().filter_map(|w| Some((w.signal.clone(), w.unit?))).collect();
    let signals = wanted.into_iter().map(|w| w.signal).zip(samples).collect();
    let recording = Recording::new(name, t, signals).map(|recording| Recording { units, ..recording });
    recording.map_err(|e| match e {
        RecordingError::NotRising { index, before, now, .. } => {
            let mut message = format!("time does not rise: {now} s after {before} s");
            if now < before {
                message.push_str("; from a file with several runs, set.toml selects one with where or rows");
            }
            FileError::at(name, lines.get(index).copied().unwrap_or(1), &time.heading, message)
        }
        RecordingError::TooShort { count, .. } => FileError::whole(name, format!("needs at least 2 rows of data, has {count}")),
        other => FileError::whole(name, other.to_string()),
    })
}

fn number(name: &str, line: usize, rows: &impl Rows, column: &Wanted) -> Result<f64, FileError> {
    let wrong = |found: String| FileError::at(name, line, &column.heading, format!("expected a number, found {found}"));
    let value = rows.number(column.index).map_err(wrong)?;
    let cell = || rows.shown(column.index);
    if !value.is_finite() {
        return Err(wrong(format!("\"{}\"; leave such rows out, or give a piece without them with rows", cell())));
    }
    let value = value * column.factor + column.offset;
    if value.abs() > LARGEST {
        return Err(wrong(format!("\"{}\", which nothing measures: a mark for a missing value? Leave such rows out", cell())));
    }
    Ok(value)
}
