//! A table becomes a bag: the one way of all formats, with units, places of columns, and what is wrong with the clock.

use super::mapping::{ColumnMap, ImportOptions, ImportReport, Quantity, topic_of};
use super::time_column::times_of;
use super::types::{Cells, Table, name_of, unit_of};
use crate::header::{BagHeader, Clock};
use crate::number_type::NumberType;
use crate::signals::TIME_TOPIC;
use crate::{BagError, Recorder, RecorderOptions, TopicInfo, clock_remarks};
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{MAX_AXES, Message, Sample, source_id};
use backdrive_plant::recording::units::{self, Unit};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Columns that a bag can hold: MCAP numbers channels with 16 bits, and some are the bag's own.
const MOST_COLUMNS: usize = 65_000;

/// A column of numbers that may go into a bag.
struct Known<'a> {
    /// What it is called there.
    name: &'a str,
    /// As they stand in the table.
    values: &'a [f64],
    /// The unit that its heading states.
    unit: Option<Unit>,
    of: NumberType,
}

/// What goes where: the place of its topic, how it gets there, and its values.
struct Source<'a> {
    topic: usize,
    quantity: Quantity,
    axis: usize,
    /// `scale * value + offset`; `None` where numbers stay as they are, their bits included.
    scaled: Option<(f64, f64)>,
    values: &'a [f64],
}

/// Writes a table, which is one experiment, as a bag; `path` is the file that it came from.
pub(crate) fn write_bag(path: &Path, table: &Table, bag: &Path, options: &ImportOptions) -> Result<ImportReport, BagError> {
    let clock = times_of(path, table, options)?;
    let times = &clock.values;
    let mut notes: Vec<String> = table.notes.iter().cloned().chain(clock.note).collect();
    let mut known: HashMap<usize, Known> = HashMap::new();
    let mut skipped: Vec<(&str, &str)> = Vec::new();
    for (place, column) in table.columns.iter().enumerate() {
        let name = name_of(&column.name);
        match &column.cells {
            Cells::Numbers(values, of) => {
                let unit = unit_of(&column.name);
                let is_meant = options.columns.is_empty() || options.columns.iter().any(|map| map.column == column.name);
                if let (None, (_, Some(text)), true) = (unit, units::split(&column.name), is_meant && Some(place) != clock.place) {
                    notes.push(format!("column {:?}: the unit {text:?} is not known, so its values stay unchanged", column.name));
                }
                known.insert(place, Known { name, values, unit, of: *of });
            }
            Cells::Large { .. } if Some(place) == clock.place => {}
            Cells::Large { per_second: Some(_), .. } => skipped.push((name, "points in time, of which a bag has one column,")),
            Cells::Large { .. } => skipped.push((name, "whole numbers beyond 2^53, which a bag does not hold exactly,")),
            Cells::Other(holds) => skipped.push((name, holds)),
        }
    }
    let mut info = vec![topic_info(TIME_TOPIC, "t")];
    let mut places = HashMap::from([(TIME_TOPIC.to_owned(), 0)]);
    let (mut types, mut stated) = (BTreeMap::new(), BTreeMap::new());
    let mut remember = |topic: &str, quantity: Quantity, axis: usize, of: NumberType| {
        if of != NumberType::Double {
            types.insert(format!("{topic}.{}[{axis}]", quantity.field()), of);
        }
    };
    remember(TIME_TOPIC, Quantity::Position, 0, clock.of);
    let maps = placed(path, table, &known, &skipped, clock.place, options)?;
    if maps.len() > MOST_COLUMNS {
        let what = format!("has {} numeric columns, and a bag can contain at most {MOST_COLUMNS}; select columns with --map", maps.len());
        return Err(table.wrong_columns(path, what));
    }
    let mut sources: Vec<Source> = Vec::with_capacity(maps.len());
    let mut taken = HashMap::new();
    for (column, map) in &maps {
        if map.axis >= MAX_AXES {
            return Err(BagError::Usage(format!("column {:?}: axis {} is beyond the last, {}", map.column, map.axis, MAX_AXES - 1)));
        }
        if let Some(other) = taken.insert((&map.topic, map.quantity.field(), map.axis), &map.column) {
            let place = format!("{}[{}] of {}", map.quantity.field(), map.axis, map.topic);
            let what = format!("columns {other:?} and {:?} both map to {place}; give their topics with --map", map.column);
            return Err(table.wrong_columns(path, what));
        }
        if let Some(row) = column.values.iter().position(|value| !value.is_finite()) {
            let found = if column.values[row].is_nan() { "none (NaN)".to_owned() } else { format!("{:?}", column.values[row]) };
            let what = format!(
                "column {:?}: expected a number, found {found}; leave such rows out, or name the columns that count with --map",
                map.column
            );
            return Err(table.wrong(path, row, what));
        }
        let place = *places.entry(map.topic.clone()).or_insert_with(|| {
            info.push(topic_info(&map.topic, if options.columns.is_empty() { &map.column } else { "axis0" }));
            info.len() - 1
        });
        for axis in info[place].axes.len()..=map.axis {
            info[place].axes.push(format!("axis{axis}"));
        }
        // A scale that somebody gives goes before the unit of the heading.
        let (scale, offset) = if (map.scale, map.offset) == (1.0, 0.0) {
            (column.unit.map_or(1.0, |unit| unit.factor), 0.0)
        } else {
            (map.scale, map.offset)
        };
        let scaled = Some((scale, offset)).filter(|scaled| *scaled != (1.0, 0.0));
        if let Some(unit) = column.unit.filter(|_| (map.scale, map.offset) == (1.0, 0.0)) {
            stated.insert(format!("{}.{}[{}]", map.topic, map.quantity.field(), map.axis), units::si(unit.kind).name.to_owned());
        }
        if scaled.is_none() {
            remember(&map.topic, map.quantity, map.axis, column.of);
        }
        sources.push(Source { topic: place, quantity: map.quantity, axis: map.axis, scaled, values: column.values });
    }
    let span = times.last().zip(times.first()).map_or(0.0, |(last, first)| last - first);
    let header = BagHeader {
        title: format!("imported from {}", path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default()),
        versions: BTreeMap::from([("backdrive".to_owned(), env!("CARGO_PKG_VERSION").to_owned())]),
        clock: Clock::Imported,
        rate_hz: if span > 0.0 { (times.len() - 1) as f64 / span } else { 0.0 },
        topics: info,
        column_types: types,
        column_units: stated,
        ..BagHeader::default()
    };
    record(bag, &header, times, &sources, options.overwrite)?;
    notes.extend(skipped.iter().map(|(name, holds)| format!("column {name:?} holds {holds} and was omitted")));
    let topics = header.topics.into_iter().skip(1).map(|info| info.topic.name).collect();
    let skipped = skipped.into_iter().map(|(name, _)| name.to_owned()).collect();
    Ok(ImportReport { rows: times.len() as u64, topics, skipped, notes, clock: clock_remarks(times) })
}

/// Which column goes where: as was asked for, or each as a topic of its own.
fn placed<'a, 'b>(
    path: &Path,
    table: &Table,
    known: &'b HashMap<usize, Known<'a>>,
    skipped: &[(&str, &str)],
    time: Option<usize>,
    options: &ImportOptions,
) -> Result<Vec<(&'b Known<'a>, ColumnMap)>, BagError> {
    if options.columns.is_empty() {
        let own = |column: &'b Known<'a>| {
            let (name, topic) = (column.name.to_owned(), topic_of(column.name));
            (column, ColumnMap { column: name, topic, quantity: Quantity::Position, axis: 0, scale: 1.0, offset: 0.0 })
        };
        let own: Vec<_> =
            (0..table.columns.len()).filter(|place| Some(*place) != time).filter_map(|place| known.get(&place)).map(own).collect();
        return match own.is_empty() {
            false => Ok(own),
            true => {
                let why: String =
                    skipped.iter().map(|(name, holds)| format!("; column {name:?} holds {}", holds.trim_end_matches(','))).collect();
                Err(table.wrong_columns(path, format!("there is no numeric column besides the times{why}")))
            }
        };
    }
    let find = |map: &ColumnMap| {
        let place = table.find(path, &map.column)?.ok_or_else(|| table.no_column(path, &map.column, ""))?;
        let holds = || skipped.iter().find(|(name, _)| *name == name_of(&table.columns[place].name)).map_or("times", |(_, holds)| *holds);
        let column = known
            .get(&place)
            .ok_or_else(|| table.wrong_columns(path, format!("column {:?} holds {}", map.column, holds().trim_end_matches(','))))?;
        Ok((column, map.clone()))
    };
    options.columns.iter().map(find).collect()
}

/// A row is a step. Half a bag would look like a whole one, so none is left behind.
fn record(bag: &Path, header: &BagHeader, times: &[f64], sources: &[Source], overwrite: bool) -> Result<(), BagError> {
    let mut recorder = Recorder::create(bag, header, &RecorderOptions { overwrite, whole: true, ..RecorderOptions::lockstep() })?;
    for (row, time) in times.iter().enumerate() {
        let mut samples: Vec<Sample> = header.topics.iter().map(|info| Sample::new(info.axes.len())).collect();
        samples[0].position[0] = *time;
        for source in sources {
            let sample = &mut samples[source.topic];
            let values = match source.quantity {
                Quantity::Position => &mut sample.position,
                Quantity::Velocity => &mut sample.velocity,
                Quantity::Effort => &mut sample.effort,
            };
            let value = source.values[row];
            values[source.axis] = source.scaled.map_or(value, |(scale, offset)| scale * value + offset);
        }
        for (index, mut sample) in samples.into_iter().enumerate() {
            (sample.step, sample.sequence, sample.source) = (row as u64, row as u64, source_id("import"));
            sample.stamp_ns = (time * 1e9).round() as i64;
            recorder.push(index, Message::Sample(sample), 0)?;
        }
    }
    recorder.finish()?;
    Ok(())
}

fn topic_info(name: &str, axis: &str) -> TopicInfo {
    let topic = Topic { name: name.to_owned(), kind: Kind::Sample };
    TopicInfo { topic, axes: vec![axis.to_owned()], publisher: "import".to_owned() }
}
