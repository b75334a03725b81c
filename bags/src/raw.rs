//! A recording as it stands in its file: nothing is aligned, interpolated or refused, so that what is wrong with it can be seen.

use crate::lerobot::episode_tables;
use crate::signals::{Series, series_of};
use crate::table::{Cells, Missing, Table, columns_of, name_of, read_table, unit_of};
use crate::{BagError, ImportOptions, LerobotOptions, Reader, Signal};
use backdrive_plant::recording::units::{self, Unit};
use std::path::Path;

/// A column as it stands in its file.
#[derive(Debug, Clone, PartialEq)]
pub struct RawColumn {
    /// Its heading without the unit; of a bag the field, such as `position[elbow]`.
    pub name: String,
    /// The unit that the heading or the bag states.
    pub unit: Option<Unit>,
    /// One a row, in the file's unit; what is missing is not finite. Empty where the column holds no numbers.
    pub values: Vec<f64>,
    /// What it holds where that is no number, as in "column x holds ...".
    pub other: Option<String>,
}

/// Columns that share their rows: a table, or a topic of a bag.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RawStream {
    /// The topic; empty for a table.
    pub topic: String,
    /// Of a bag: the stamps of its messages, s; `None` for a table, whose times are a column.
    pub stamps: Option<Vec<f64>>,
    /// Of a bag: when the messages were logged, s from the same beginning as the stamps.
    pub logged: Vec<f64>,
    /// The columns.
    pub columns: Vec<RawColumn>,
    /// Of text, the line of each row, from 1.
    pub lines: Vec<u64>,
}

/// One recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RawRecording {
    /// Of a dataset, the episode; else empty.
    pub episode: String,
    /// A table has one, a bag one a topic.
    pub streams: Vec<RawStream>,
    /// What a person should know of the file: a sentence each.
    pub notes: Vec<String>,
}

/// Reads a table of any format as it stands. Of `options` the headings and the variable count; no column has to be the time.
///
/// # Errors
/// The file cannot be read, or is no table.
pub fn raw_table(path: &Path, options: &ImportOptions) -> Result<RawRecording, BagError> {
    // A rate makes the longest arrays of a file the columns, whatever the times are called.
    let options = ImportOptions { time: String::new(), rate_hz: Some(1.0), ..options.clone() };
    Ok(of_table(String::new(), read_table(path, &options, Missing::Stays)?))
}

/// Reads the episodes of a LeRobot dataset as they stand.
///
/// # Errors
/// It is no dataset of version 3, or a file of it is damaged.
pub fn raw_lerobot(folder: &Path, options: &LerobotOptions) -> Result<Vec<RawRecording>, BagError> {
    Ok(episode_tables(folder, options)?.into_iter().map(|(name, table)| of_table(name, table)).collect())
}

fn of_table(episode: String, table: Table) -> RawRecording {
    let column = |column: crate::table::Column| {
        let (name, unit) = (name_of(&column.name).to_owned(), unit_of(&column.name));
        match column.cells {
            Cells::Numbers(values, _) => RawColumn { name, unit, values, other: None },
            Cells::Large { values, per_second } => {
                let first = values.first().copied().unwrap_or(0);
                // Differences of whole numbers are exact where the numbers themselves are no doubles.
                let scale = per_second.map_or(1.0, |per_second| 1.0 / per_second);
                let values = values.iter().map(|value| (i128::from(*value) - i128::from(first)) as f64 * scale).collect();
                let unit = per_second.map(|_| units::si(units::Kind::Time)).or(unit);
                RawColumn { name, unit, values, other: None }
            }
            Cells::Other(holds) => RawColumn { name, unit, values: Vec::new(), other: Some(holds.trim_end_matches(',').to_owned()) },
        }
    };
    let lines = table.lines.map_or_else(Vec::new, |lines| lines.rows);
    let stream = RawStream { columns: table.columns.into_iter().map(column).collect(), lines, ..RawStream::default() };
    RawRecording { episode, streams: vec![stream], notes: table.notes }
}

/// Reads every number of a bag, topic by topic, each with the stamps and the log times of its own messages.
///
/// # Errors
/// The bag is damaged, or no topic has numbers that are read.
pub fn raw_bag(reader: &Reader) -> Result<RawRecording, BagError> {
    let wanted = columns_of(reader, None)?;
    let mut notes: Vec<String> =
        reader.end_missing().into_iter().chain(reader.topics().iter().filter_map(|topic| topic.unread())).collect();
    notes.extend(reader.damage().iter().cloned());
    if wanted.is_empty() {
        let what = notes.first().cloned().unwrap_or_else(|| "has no topic with numbers".to_owned());
        return Err(BagError::File { path: reader.path().to_owned(), what });
    }
    if crate::table::was_table(reader) {
        return imported(reader, &wanted, notes);
    }
    let gathered = series_of(reader, &wanted, usize::MAX)?;
    let mut streams: Vec<RawStream> = Vec::new();
    for (signal, series) in wanted.iter().zip(gathered.series) {
        let (column, times, logged) = of_series(reader, signal, series);
        match streams.iter_mut().find(|stream| stream.topic == signal.topic) {
            Some(stream) => stream.columns.push(column),
            None => {
                let topic = signal.topic.clone();
                streams.push(RawStream { topic, stamps: Some(times), logged, columns: vec![column], lines: Vec::new() });
            }
        }
    }
    Ok(RawRecording { episode: String::new(), streams, notes })
}

/// A bag that was a table: one stream again, with the exact times of its rows.
fn imported(reader: &Reader, wanted: &[Signal], notes: Vec<String>) -> Result<RawRecording, BagError> {
    let gathered = series_of(reader, wanted, usize::MAX)?;
    let stamps = gathered.clock.map(|clock| clock.values);
    let columns = wanted.iter().zip(gathered.series).map(|(signal, series)| {
        let (column, ..) = of_series(reader, signal, series);
        RawColumn { name: signal.name.clone(), ..column }
    });
    let stream = RawStream { stamps, columns: columns.collect(), ..RawStream::default() };
    Ok(RawRecording { episode: String::new(), streams: vec![stream], notes })
}

fn of_series(reader: &Reader, signal: &Signal, series: Series) -> (RawColumn, Vec<f64>, Vec<f64>) {
    let stated = reader.header().and_then(|header| header.column_units.get(&format!("{}.{}", signal.topic, signal.field)));
    let unit = stated.and_then(|unit| units::parse(unit).ok());
    (RawColumn { name: signal.field.clone(), unit, values: series.values, other: None }, series.times, series.logged)
}
