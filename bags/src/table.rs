//! To and from CSV tables.

use crate::header::{BagHeader, Clock};
use crate::signals::{TIME_TOPIC, gather};
use crate::{BagError, Reader, Recorder, RecorderOptions, Signal, TopicInfo, clock_remarks};
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{MAX_AXES, Message, Sample, source_id};
use backdrive_plant::model::Hold;
use backdrive_plant::recording::units;
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Writes one table: `t`, `step` (if the messages have steps), and every signal as `topic.field.axis`.
///
/// Numbers have the shortest digits that read back to the same bits; what was not measured is `nan`. Topics that
/// speak now and then (gains) have their last value in every row. `topics` limits it to some. Returns the rows.
///
/// Errors: a topic that is not there, nothing to write, a damaged bag, `out` exists or cannot be written.
pub fn export_csv(reader: &Reader, out: &Path, topics: Option<&[String]>) -> Result<u64, BagError> {
    for name in topics.unwrap_or_default() {
        reader.topic(name)?;
    }
    let wanted = columns_of(reader, topics)?;
    if wanted.is_empty() {
        return Err(BagError::Usage(format!("{} has no numbers to export", reader.path().display())));
    }
    let table = gather(reader, &wanted, false, usize::MAX)?;
    let file = std::fs::File::create_new(out).map_err(BagError::io(out))?;
    let mut csv = csv::Writer::from_writer(std::io::BufWriter::new(file));
    let failed = |error: csv::Error| BagError::Write { name: out.display().to_string(), what: error.to_string() };
    let mut row: Vec<String> = vec!["t".to_owned()];
    // The steps of a table that was imported are its rows.
    let steps = table.steps.filter(|_| !was_table(reader));
    row.extend(steps.is_some().then(|| "step".to_owned()));
    row.extend(table.names);
    csv.write_record(&row).map_err(failed)?;
    for (index, t) in table.t.iter().enumerate() {
        row.clear();
        row.push(digits(*t));
        row.extend(steps.as_ref().map(|steps| steps[index].to_string()));
        row.extend(table.columns.iter().map(|column| digits(column[index])));
        csv.write_record(&row).map_err(failed)?;
    }
    csv.flush().map_err(BagError::io(out))?;
    Ok(table.t.len() as u64)
}

fn digits(value: f64) -> String {
    if value.is_nan() { "nan".to_owned() } else { format!("{value:?}") }
}

/// The signals of all topics that have numbers: those of ours that were measured at least once, of others every number.
///
/// # Errors
/// When the bag cannot be read.
pub fn columns_of(reader: &Reader, topics: Option<&[String]>) -> Result<Vec<Signal>, BagError> {
    let listed = |name: &str| topics.is_none_or(|topics| topics.iter().any(|topic| topic == name));
    let count = reader.topics().len();
    let mut measured = vec![[[false; MAX_AXES]; 3]; count];
    let mut foreign: Vec<Option<Vec<String>>> = vec![None; count];
    let mut gains = vec![false; count];
    for entry in reader.messages()? {
        let entry = entry?;
        let index = entry.topic.index;
        if !listed(&entry.topic.name) || entry.topic.name == TIME_TOPIC {
            continue;
        }
        match entry.message(reader.path())? {
            Some(Message::Sample(sample)) => {
                for (seen, values) in measured[index].iter_mut().zip([&sample.position, &sample.velocity, &sample.effort]) {
                    seen.iter_mut().zip(values).for_each(|(seen, value)| *seen |= !value.is_nan());
                }
            }
            Some(Message::Gains(_)) => gains[index] = true,
            Some(Message::Event(_) | Message::Status(_) | Message::Margin(_)) => {}
            // A topic whose fields cannot be read has no columns.
            None if foreign[index].is_none() => {
                let numbers = entry.topic.parse_schema().ok().and_then(|schema| schema.numbers(&entry.payload).ok());
                foreign[index] = Some(numbers.unwrap_or_default());
            }
            None => {}
        }
    }
    let mut wanted = Vec::new();
    for topic in reader.topics() {
        for (quantity, seen) in Quantity::ALL.iter().zip(&measured[topic.index]) {
            for axis in (0..MAX_AXES).filter(|axis| seen[*axis]) {
                let name = topic.axes.get(axis).cloned().unwrap_or_else(|| format!("axis{axis}"));
                let field = format!("{}[{axis}]", quantity.field());
                // A column that was imported is called as it was in its table.
                let own = was_table(reader) && axis == 0 && *quantity == Quantity::Position && topic.name == topic_of(&name);
                let shown = if own { name } else { format!("{}.{}.{name}", topic.name, quantity.field()) };
                wanted.push(Signal::new(&shown, &topic.name, &field));
            }
        }
        for field in ["mu", "lambda"].iter().filter(|_| gains[topic.index]) {
            wanted.push(Signal { hold: Hold::Zero, ..Signal::new(&format!("{}.{field}", topic.name), &topic.name, field) });
        }
        for field in foreign[topic.index].iter().flatten().filter(|field| !field.starts_with("header.")) {
            wanted.push(Signal::new(&format!("{}.{field}", topic.name), &topic.name, field));
        }
    }
    Ok(wanted)
}

/// Whether a bag was made of a table.
fn was_table(reader: &Reader) -> bool {
    reader.header().is_some_and(|header| header.clock == Clock::Imported)
}

/// What a column is of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quantity {
    /// m or rad.
    #[default]
    Position,
    /// m/s or rad/s.
    Velocity,
    /// N or N m.
    Effort,
}

impl Quantity {
    const ALL: [Quantity; 3] = [Quantity::Position, Quantity::Velocity, Quantity::Effort];

    /// Name of the field in a JointState.
    pub fn field(self) -> &'static str {
        match self {
            Quantity::Position => "position",
            Quantity::Velocity => "velocity",
            Quantity::Effort => "effort",
        }
    }
}

/// Where a column goes: `scale * cell + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnMap {
    /// Heading of the column.
    pub column: String,
    /// Topic that gets it.
    pub topic: String,
    /// As what.
    pub quantity: Quantity,
    /// Of which axis, below [`MAX_AXES`].
    pub axis: usize,
    /// Factor to SI units.
    pub scale: f64,
    /// Then added.
    pub offset: f64,
}

/// How a table becomes a bag.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportOptions {
    /// Heading of the column with the times, s.
    pub time: String,
    /// Where columns go. When empty, each column becomes `position[0]` of a topic of its own, `/recording/NAME`, in which
    /// letters that ROS does not allow are `_`.
    pub columns: Vec<ColumnMap>,
    /// Replace a bag that exists.
    pub overwrite: bool,
}

impl Default for ImportOptions {
    fn default() -> ImportOptions {
        ImportOptions { time: "t".to_owned(), columns: Vec::new(), overwrite: false }
    }
}

/// What an import did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImportReport {
    /// Rows, which are steps in the bag.
    pub rows: u64,
    /// Topics written, without that of the times.
    pub topics: Vec<String>,
    /// Columns left out because they hold something that is no number.
    pub skipped: Vec<String>,
    /// What is wrong with the clock: a sentence each, see [`clock_remarks`].
    pub clock: Vec<String>,
}

/// Turns a table, which is one experiment, into a bag that [`crate::signals()`] reads the same numbers from.
///
/// A row is a step, its stamp the row's time to the ns; the exact time is in `position[0]` of `/recording/t`. A heading may name its unit
/// (`x [mm]`): the bag holds SI units. As where a table is read as it is, an empty cell or `nan` is an error. Errors: the file cannot be read, a column is missing, a time is no number or
/// goes back, a mapped cell is no number, `bag` exists or cannot be written.
pub fn import_csv(table: &Path, bag: &Path, options: &ImportOptions) -> Result<ImportReport, BagError> {
    let Table { headings, columns, skipped } = Table::read(table, options)?;
    let at = |heading: &str| headings.iter().position(|found| found == heading);
    let missing = |heading: &str| {
        let what = match skipped.iter().any(|skipped| skipped == heading) {
            true => format!("column {heading:?} holds something that is no number"),
            false if headings.iter().all(String::is_empty) => "is empty, expected a heading such as t,force,position".to_owned(),
            false => format!("there is no column {heading:?}; there is {}", headings.join(", ")),
        };
        BagError::Table { path: table.to_owned(), line: 1, what }
    };
    let times = &columns[at(&options.time).ok_or_else(|| missing(&options.time))?];
    if times.is_empty() {
        return Err(BagError::Table { path: table.to_owned(), line: 1, what: "there are no rows below the heading".to_owned() });
    }
    for (row, pair) in times.windows(2).enumerate() {
        if pair[1].is_nan() || pair[1] <= pair[0] {
            let what = match pair[1] == pair[0] {
                true => format!("the time {:?} s stands in two rows; leave out what was recorded twice", pair[0]),
                false => format!("time goes back from {:?} to {:?} s; cut the recording there", pair[0], pair[1]),
            };
            return Err(BagError::Table { path: table.to_owned(), line: row as u64 + 3, what });
        }
    }
    if let Some(time) = times.iter().find(|time| time.is_nan() || time.abs() > 9.2e9) {
        return Err(BagError::Table { path: table.to_owned(), line: 2, what: format!("{time:?} is no time in s") });
    }
    let maps = if options.columns.is_empty() { default_maps(&headings, &options.time) } else { options.columns.clone() };
    let mut info = vec![topic_info(TIME_TOPIC, "t")];
    let mut sources: Vec<(usize, &ColumnMap, &[f64])> = Vec::with_capacity(maps.len());
    let mut taken = HashMap::new();
    for map in &maps {
        if map.axis >= MAX_AXES {
            return Err(BagError::Usage(format!("column {:?}: axis {} is beyond the last, {}", map.column, map.axis, MAX_AXES - 1)));
        }
        if let Some(other) = taken.insert((&map.topic, map.quantity.field(), map.axis), &map.column) {
            return Err(BagError::Usage(format!(
                "columns {other:?} and {:?} both go to {}[{}] of {}",
                map.column,
                map.quantity.field(),
                map.axis,
                map.topic
            )));
        }
        let column = &columns[at(&map.column).ok_or_else(|| missing(&map.column))?];
        let place = info.iter().position(|info| info.topic.name == map.topic).unwrap_or_else(|| {
            info.push(topic_info(&map.topic, if options.columns.is_empty() { &map.column } else { "axis0" }));
            info.len() - 1
        });
        for axis in info[place].axes.len()..=map.axis {
            info[place].axes.push(format!("axis{axis}"));
        }
        sources.push((place, map, column));
    }
    let span = times.last().zip(times.first()).map_or(0.0, |(last, first)| last - first);
    let header = BagHeader {
        title: format!("imported from {}", table.file_name().map(|name| name.to_string_lossy()).unwrap_or_default()),
        versions: BTreeMap::from([("backdrive".to_owned(), env!("CARGO_PKG_VERSION").to_owned())]),
        clock: Clock::Imported,
        rate_hz: if span > 0.0 { (times.len() - 1) as f64 / span } else { 0.0 },
        topics: info,
        ..BagHeader::default()
    };
    let mut recorder = Recorder::create(bag, &header, &RecorderOptions { overwrite: options.overwrite, ..RecorderOptions::lockstep() })?;
    for (row, time) in times.iter().enumerate() {
        let mut samples: Vec<Sample> = header.topics.iter().map(|info| Sample::new(info.axes.len())).collect();
        samples[0].position[0] = *time;
        for (place, map, column) in &sources {
            let sample = &mut samples[*place];
            let values = match map.quantity {
                Quantity::Position => &mut sample.position,
                Quantity::Velocity => &mut sample.velocity,
                Quantity::Effort => &mut sample.effort,
            };
            // Unscaled cells keep their bits, the sign of a zero included.
            let unscaled = (map.scale, map.offset) == (1.0, 0.0);
            values[map.axis] = if unscaled { column[row] } else { map.scale * column[row] + map.offset };
        }
        for (index, mut sample) in samples.into_iter().enumerate() {
            (sample.step, sample.sequence, sample.source) = (row as u64, row as u64, source_id("import"));
            sample.stamp_ns = (time * 1e9).round() as i64;
            recorder.push(index, Message::Sample(sample), 0)?;
        }
    }
    recorder.finish()?;
    let topics = header.topics.into_iter().skip(1).map(|info| info.topic.name).collect();
    Ok(ImportReport { rows: times.len() as u64, topics, skipped, clock: clock_remarks(times) })
}

fn topic_info(name: &str, axis: &str) -> TopicInfo {
    let topic = Topic { name: name.to_owned(), kind: Kind::Sample };
    TopicInfo { topic, axes: vec![axis.to_owned()], publisher: "import".to_owned() }
}

/// The topic that a signal of this name has to itself in a bag made of a table: `/recording/NAME`, in which what ROS does not allow in a name
/// is `_`.
pub fn topic_of(column: &str) -> String {
    let name: String = column.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
    format!("/recording/{name}")
}

fn default_maps(headings: &[String], time: &str) -> Vec<ColumnMap> {
    let map = |column: &String| {
        let (column, topic) = (column.clone(), topic_of(column));
        ColumnMap { column, topic, quantity: Quantity::Position, axis: 0, scale: 1.0, offset: 0.0 }
    };
    headings.iter().filter(|heading| *heading != time).map(map).collect()
}

/// A table whose columns are all numbers.
struct Table {
    headings: Vec<String>,
    columns: Vec<Vec<f64>>,
    skipped: Vec<String>,
}

impl Table {
    fn read(path: &Path, options: &ImportOptions) -> Result<Table, BagError> {
        let wrong = |line: u64, what: String| BagError::Table { path: path.to_owned(), line, what };
        let failed = |error: csv::Error| {
            let line = error.position().map_or(1, csv::Position::line);
            wrong(line, error.to_string())
        };
        let file = std::fs::File::open(path).map_err(BagError::io(path))?;
        let mut csv = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(std::io::BufReader::new(file));
        let headings: Vec<String> =
            csv.headers().map_err(failed)?.iter().map(|heading| heading.trim_start_matches('\u{feff}').to_owned()).collect();
        let mut columns: Vec<Option<Vec<f64>>> = vec![Some(Vec::new()); headings.len()];
        let asked = |heading: &str| heading == options.time || options.columns.iter().any(|map| map.column == heading);
        // A heading that is asked for whole is taken so, another one by its name, in SI units.
        let known = |heading: &str| units::split(heading).1.and_then(|unit| units::parse(unit).ok()).filter(|_| !asked(heading));
        let factors: Vec<f64> = headings.iter().map(|heading| known(heading).map_or(1.0, |unit| unit.factor)).collect();
        let headings: Vec<String> =
            headings.iter().map(|heading| known(heading).map_or(heading.as_str(), |_| units::split(heading).0).to_owned()).collect();
        let needed = |heading: &String| asked(heading);
        let mut record = csv::StringRecord::new();
        while csv.read_record(&mut record).map_err(failed)? {
            for (values_of, ((cell, column), heading)) in record.iter().zip(&mut columns).zip(&headings).enumerate() {
                let Some(values) = column else { continue };
                let line = || record.position().map_or(0, csv::Position::line);
                match cell.parse::<f64>() {
                    Ok(value) if value.is_finite() => values.push(value * factors[values_of]),
                    Ok(_) => {
                        return Err(wrong(line(), format!("column {heading:?}: expected a number, found {cell:?}; leave such rows out")));
                    }
                    Err(_) if cell.is_empty() && !values.is_empty() => {
                        return Err(wrong(
                            line(),
                            format!("column {heading:?}: expected a number, found an empty cell; leave such rows out"),
                        ));
                    }
                    Err(_) if needed(heading) => {
                        return Err(wrong(line(), format!("column {heading:?}: {cell:?} is not a number")));
                    }
                    Err(_) => *column = None,
                }
            }
        }
        let skipped = headings.iter().zip(&columns).filter(|(_, column)| column.is_none()).map(|(heading, _)| heading.clone()).collect();
        let (headings, columns) = headings.into_iter().zip(columns).filter_map(|(heading, column)| Some((heading, column?))).unzip();
        Ok(Table { headings, columns, skipped })
    }
}
