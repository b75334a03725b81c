//! CSV recordings.

use super::columns::{Columns, Piece, Source};
use super::record::{LARGEST, Recording, RecordingError, signals_of};
use super::text_table::{TextTable, comma_remark};
use super::units::{self, Kind, Unit};
use crate::model::Model;
use crate::tomlfile::{self, FileError};
use csv::StringRecord;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// A column to be read.
struct Wanted {
    signal: String,
    heading: String,
    index: usize,
    factor: f64,
    offset: f64,
    /// The unit whose kind has to go with the signal.
    unit: Option<Unit>,
}

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

/// Reads the signals of a model from a CSV file: its inputs, and those of its outputs that were recorded. Other columns may hold anything.
///
/// Where an input is missing that `may_be_absent` does not excuse, all columns are read, so that the caller can list what there is.
///
/// # Errors
/// As [`read_csv`].
pub fn read_signals_of(
    path: &Path,
    model: &Model,
    columns: &Columns,
    piece: &Piece,
    may_be_absent: &dyn Fn(&str) -> bool,
) -> Result<Recording, FileError> {
    // An error of the whole file is reported by the code that reads the whole file.
    let Ok(headings) = read_headings(path) else { return read_csv(path, None, columns, piece) };
    let there = |signal: &str| {
        columns.iter().any(|(ruled, _)| ruled == signal) || headings.iter().any(|h| h == signal || units::split(h).0 == signal)
    };
    let needed = |name: &str| model.inputs.iter().any(|input| input.name == name) && !may_be_absent(name);
    let wanted: Vec<&str> = signals_of(model).into_iter().filter(|signal| there(signal)).collect();
    if signals_of(model).into_iter().all(|signal| there(signal) || !needed(signal)) {
        return read_csv(path, Some(&wanted), columns, piece);
    }
    // Where a column of words prevents reading all, the missing one is reported.
    let with_missing: Vec<&str> = signals_of(model).into_iter().filter(|signal| there(signal) || needed(signal)).collect();
    read_csv(path, None, columns, piece).or_else(|_| read_csv(path, Some(&with_missing), columns, piece))
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
    let file = Headings { name: &name, line: heading_line, headings: &headings };
    let time = file.find("t", columns)?;
    let time = file.timed(time, columns)?;
    if let Some(unit) = time.unit.filter(|unit| unit.kind != Kind::Time) {
        return Err(FileError::at(
            &name,
            heading_line,
            &time.heading,
            format!("is in {}, {}, expected a time such as s or ms", unit.name, unit.kind.text()),
        ));
    }
    let wanted = match signals {
        Some(signals) => signals.iter().map(|s| file.find(s, columns)).collect::<Result<Vec<_>, _>>()?,
        None => file.all(columns, &time)?,
    };
    let chosen = piece
        .keep
        .iter()
        .map(|(column, cell)| Ok((file.index_of(column, column, "where")?, cell)))
        .collect::<Result<Vec<_>, FileError>>()?;

    let mut t = Vec::new();
    let mut lines = Vec::new();
    let mut samples = vec![Vec::new(); wanted.len()];
    let mut record = StringRecord::new();
    let mut row = 0;
    let [from, to] = piece.rows.unwrap_or([0, usize::MAX]);
    loop {
        let next = if row >= to { Ok(None) } else { table.next(&mut record) };
        let Some(line) = next.map_err(|(line, what)| FileError::at(&name, line as usize, "", what))? else { break };
        let line = line as usize;
        row += 1;
        if row <= from || !chosen.iter().all(|(index, cell)| cell.matches(&record[*index])) {
            continue;
        }
        t.push(number(&name, line, &record, &time)?);
        lines.push(line);
        for (column, values) in wanted.iter().zip(&mut samples) {
            values.push(number(&name, line, &record, column)?);
        }
    }
    if piece.rows.is_some() && row < to {
        return Err(FileError::whole(&name, format!("rows [{from}, {to}] reach beyond its {row} rows of data")));
    }
    if t.is_empty() && !piece.keep.is_empty() {
        return Err(FileError::whole(&name, "no row has the values that where asks for"));
    }
    let units = wanted.iter().filter_map(|w| Some((w.signal.clone(), w.unit?))).collect();
    let signals = wanted.into_iter().map(|w| w.signal).zip(samples).collect();
    let recording = Recording::new(&name, t, signals).map(|recording| Recording { units, ..recording });
    recording.map_err(|e| match e {
        RecordingError::NotRising { index, before, now, .. } => {
            let mut message = format!("time does not rise: {now} s after {before} s");
            if now < before {
                message.push_str("; from a file with several runs, set.toml selects one with where or rows");
            }
            FileError::at(&name, lines.get(index).copied().unwrap_or(1), &time.heading, message)
        }
        RecordingError::TooShort { count, .. } => FileError::whole(&name, format!("needs at least 2 rows of data, has {count}")),
        other => FileError::whole(&name, other.to_string()),
    })
}

fn number(name: &str, line: usize, record: &StringRecord, column: &Wanted) -> Result<f64, FileError> {
    let cell = &record[column.index];
    let wrong = |found: String| FileError::at(name, line, &column.heading, format!("expected a number, found {found}"));
    let value: f64 = cell
        .parse()
        .map_err(|_| wrong(if cell.is_empty() { "an empty cell".into() } else { format!("\"{cell}\"{}", comma_remark(cell)) }))?;
    if !value.is_finite() {
        return Err(wrong(format!("\"{cell}\"; leave such rows out, or give a piece without them with rows")));
    }
    let value = value * column.factor + column.offset;
    if value.abs() > LARGEST {
        return Err(wrong(format!("\"{cell}\", which nothing measures: a mark for a missing value? Leave such rows out")));
    }
    Ok(value)
}

struct Headings<'a> {
    name: &'a str,
    /// Where the heading stands.
    line: usize,
    headings: &'a StringRecord,
}

impl Headings<'_> {
    fn index_of(&self, heading: &str, signal: &str, asked_by: &str) -> Result<usize, FileError> {
        let mut found = self.headings.iter().enumerate().filter(|h| h.1 == heading).map(|h| h.0);
        // Without its unit a heading is meant too, where no column is called exactly so.
        let mut bare = self.headings.iter().enumerate().filter(|h| units::split(h.1).0 == heading).map(|h| h.0);
        let pair = (found.next(), found.next());
        match if pair.0.is_some() { pair } else { (bare.next(), bare.next()) } {
            (Some(index), None) => Ok(index),
            (Some(_), Some(_)) => Err(FileError::at(self.name, self.line, heading, "two columns have this heading")),
            (None, _) => {
                let mut message = tomlfile::unknown("column", heading, self.headings.iter());
                if heading == signal && asked_by.is_empty() {
                    message.push_str(&format!(" ([columns] {signal} = \"...\" names the column)"));
                }
                Err(FileError::at(self.name, self.line, asked_by, message))
            }
        }
    }

    fn find(&self, signal: &str, columns: &Columns) -> Result<Wanted, FileError> {
        let rule = columns.iter().find(|c| c.0 == signal).map(|c| &c.1);
        let heading = match rule.map(|r| &r.source) {
            None => signal,
            Some(Source::Column(heading)) => heading,
            Some(Source::Topic { topic, .. }) => {
                let message = format!("[columns] reads \"{signal}\" from the topic {topic}, but a CSV file has columns");
                return Err(FileError::at(self.name, self.line, "", message));
            }
        };
        let asked_by = if rule.is_some() && heading != signal { format!("[columns] {signal}") } else { String::new() };
        let index = self.index_of(heading, signal, &asked_by)?;
        let heading = self.headings.get(index).unwrap_or(heading).to_string();
        let (factor, unit) = match rule.filter(|r| r.unit.is_some() || r.scale.is_some()) {
            Some(rule) => (rule.factor(), rule.checked_unit()),
            None => {
                let unit = units::split(&heading).1.map(units::parse).transpose();
                let unit = unit.map_err(|message| {
                    FileError::at(
                        self.name,
                        self.line,
                        &heading,
                        format!("{message}; or set scale for \"{signal}\" under [columns] of set.toml"),
                    )
                })?;
                (unit.map_or(1.0, |u| u.factor), unit)
            }
        };
        let offset = rule.map_or(0.0, |r| r.offset);
        Ok(Wanted { signal: signal.to_string(), heading, index, factor, offset, unit })
    }

    /// The column of the times: `time_ms` is in ms unless another unit is stated.
    fn timed(&self, time: Wanted, columns: &Columns) -> Result<Wanted, FileError> {
        let is_ruled = columns.iter().any(|(signal, rule)| signal == "t" && (rule.unit.is_some() || rule.scale.is_some()));
        match units::of_times(&time.heading) {
            _ if is_ruled || time.unit.is_some() => Ok(time),
            Ok(Some(unit)) => Ok(Wanted { factor: unit.factor, unit: Some(unit), ..time }),
            Ok(None) => Ok(time),
            Err(message) => Err(FileError::at(self.name, self.line, &time.heading, message)),
        }
    }

    /// Every signal that `columns` names, and every other column by its own heading.
    fn all(&self, columns: &Columns, time: &Wanted) -> Result<Vec<Wanted>, FileError> {
        let ruled = columns.iter().map(|c| c.0.as_str()).filter(|s| *s != "t");
        let mut wanted = ruled.map(|s| self.find(s, columns)).collect::<Result<Vec<_>, _>>()?;
        for heading in self.headings {
            let index = self.index_of(heading, heading, "")?;
            let (name, unit) = units::split(heading);
            if index == time.index || wanted.iter().any(|w| w.index == index || w.signal == heading) {
                continue;
            }
            let heading = heading.to_string();
            // A column that was not requested may be in any unit: where it is not known, the column keeps its whole heading as its name.
            let known = unit.map(units::parse).transpose().ok().filter(|_| !wanted.iter().any(|w| w.signal == name));
            wanted.push(match known {
                Some(unit) => {
                    Wanted { signal: name.to_string(), heading, index, factor: unit.map_or(1.0, |u| u.factor), offset: 0.0, unit }
                }
                None => Wanted { signal: heading.clone(), heading, index, factor: 1.0, offset: 0.0, unit: None },
            });
        }
        Ok(wanted)
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
