//! A table becomes a bag: the one way of all formats, with units, places of columns, and what is wrong with the clock.

use super::mapping::{ColumnMap, ImportOptions, ImportReport, Quantity, topic_of};
use super::types::{Cells, Table};
use crate::header::{BagHeader, Clock};
use crate::number_type::NumberType;
use crate::signals::TIME_TOPIC;
use crate::{BagError, Recorder, RecorderOptions, TopicInfo, clock_remarks};
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{MAX_AXES, Message, Sample, source_id};
use backdrive_plant::recording::units::{self, Unit};
use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// The unit that a heading names, where it is known and the heading is not asked for whole: then the column is called by its name, in SI units.
pub(crate) fn unit_of(heading: &str, options: &ImportOptions) -> Option<Unit> {
    let asked = heading == options.time || options.columns.iter().any(|map| map.column == heading);
    units::split(heading).1.and_then(|unit| units::parse(unit).ok()).filter(|_| !asked)
}

/// What a column is called in the bag.
pub(crate) fn name_of<'a>(heading: &'a str, options: &ImportOptions) -> &'a str {
    unit_of(heading, options).map_or(heading, |_| units::split(heading).0)
}

/// A column in SI units.
struct Known<'a> {
    name: &'a str,
    values: Cow<'a, [f64]>,
    of: NumberType,
}

/// Writes a table, which is one experiment, as a bag; `path` is the file that it came from.
pub(crate) fn write_bag(path: &Path, table: &Table, bag: &Path, options: &ImportOptions) -> Result<ImportReport, BagError> {
    let mut notes = table.notes.clone();
    let mut known: Vec<Known> = Vec::with_capacity(table.columns.len());
    let mut skipped: Vec<(&str, Cow<str>)> = Vec::new();
    for column in &table.columns {
        let (name, unit) = (name_of(&column.name, options), unit_of(&column.name, options));
        match &column.cells {
            Cells::Numbers(values, of) => known.push(match unit.map_or(1.0, |unit| unit.factor) {
                1.0 => Known { name, values: values.into(), of: *of },
                factor => Known { name, values: values.iter().map(|value| value * factor).collect(), of: NumberType::Double },
            }),
            Cells::Large { values, per_second } if name == options.time => {
                let unit = unit.filter(|unit| unit.kind == units::Kind::Time).map(|unit| (1.0 / unit.factor).round());
                let Some(per_second) = per_second.or(unit) else {
                    let what = format!(
                        "the times in {name:?} are whole numbers beyond 2^53: say their unit in the heading, as in \"{name} [ns]\""
                    );
                    return Err(table.wrong_columns(path, what));
                };
                let first = values.first().copied().unwrap_or(0);
                // Differences of whole numbers: seconds since 1970 would leave only 0.2 us of a double.
                let times = values.iter().map(|value| (i128::from(*value) - i128::from(first)) as f64 / per_second).collect();
                notes.push(format!("times are counted from the first row, whose {name:?} is {first}"));
                known.push(Known { name, values: times, of: NumberType::Double });
            }
            Cells::Large { .. } => skipped.push((name, "whole numbers beyond 2^53, which a bag does not hold exactly,".into())),
            Cells::Other(holds) => skipped.push((name, holds.into())),
        }
    }
    let names: Vec<&str> = known.iter().map(|column| column.name).collect();
    let missing = |heading: &str| {
        let what = match skipped.iter().find(|skipped| skipped.0 == heading) {
            Some((_, holds)) => format!("column {heading:?} holds {holds}"),
            None if names.iter().all(|name| name.is_empty()) => "is empty, expected a heading such as t,force,position".to_owned(),
            None => format!("there is no column {heading:?}; there is {}", names.join(", ")),
        };
        table.wrong_columns(path, what)
    };
    let find = |heading: &str| known.iter().find(|column| column.name == heading).ok_or_else(|| missing(heading));
    let clock = find(&options.time)?;
    let times = &clock.values;
    if times.is_empty() {
        return Err(table.wrong_columns(path, "there are no rows below the heading".to_owned()));
    }
    check_times(path, table, times)?;
    let maps = if options.columns.is_empty() { default_maps(&names, &options.time) } else { options.columns.clone() };
    let mut info = vec![topic_info(TIME_TOPIC, "t")];
    let mut types = BTreeMap::new();
    let mut remember = |topic: &str, quantity: Quantity, axis: usize, of: NumberType| {
        if of != NumberType::Double {
            types.insert(format!("{topic}.{}[{axis}]", quantity.field()), of);
        }
    };
    remember(TIME_TOPIC, Quantity::Position, 0, clock.of);
    let mut sources: Vec<(usize, &ColumnMap, &[f64])> = Vec::with_capacity(maps.len());
    let mut taken = HashMap::new();
    for map in &maps {
        if map.axis >= MAX_AXES {
            return Err(BagError::Usage(format!("column {:?}: axis {} is beyond the last, {}", map.column, map.axis, MAX_AXES - 1)));
        }
        if let Some(other) = taken.insert((&map.topic, map.quantity.field(), map.axis), &map.column) {
            let place = format!("{}[{}] of {}", map.quantity.field(), map.axis, map.topic);
            return Err(BagError::Usage(format!("columns {other:?} and {:?} both go to {place}", map.column)));
        }
        let column = find(&map.column)?;
        if let Some(row) = column.values.iter().position(|value| !value.is_finite()) {
            let found = if column.values[row].is_nan() { "none (NaN)".to_owned() } else { format!("{:?}", column.values[row]) };
            let what = format!(
                "column {:?}: expected a number, found {found}; leave such rows out, or name the columns that count with --map",
                map.column
            );
            return Err(table.wrong(path, row, what));
        }
        let place = info.iter().position(|info| info.topic.name == map.topic).unwrap_or_else(|| {
            info.push(topic_info(&map.topic, if options.columns.is_empty() { &map.column } else { "axis0" }));
            info.len() - 1
        });
        for axis in info[place].axes.len()..=map.axis {
            info[place].axes.push(format!("axis{axis}"));
        }
        // Unscaled cells keep their type, and their bits, the sign of a zero included.
        if (map.scale, map.offset) == (1.0, 0.0) {
            remember(&map.topic, map.quantity, map.axis, column.of);
        }
        sources.push((place, map, &column.values));
    }
    let span = times.last().zip(times.first()).map_or(0.0, |(last, first)| last - first);
    let header = BagHeader {
        title: format!("imported from {}", path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default()),
        versions: BTreeMap::from([("backdrive".to_owned(), env!("CARGO_PKG_VERSION").to_owned())]),
        clock: Clock::Imported,
        rate_hz: if span > 0.0 { (times.len() - 1) as f64 / span } else { 0.0 },
        topics: info,
        column_types: types,
        ..BagHeader::default()
    };
    record(bag, &header, times, &sources, options.overwrite)?;
    notes.extend(skipped.iter().map(|(name, holds)| format!("column {name:?} holds {holds} and was left out")));
    let topics = header.topics.into_iter().skip(1).map(|info| info.topic.name).collect();
    let skipped = skipped.into_iter().map(|(name, _)| name.to_owned()).collect();
    Ok(ImportReport { rows: times.len() as u64, topics, skipped, notes, clock: clock_remarks(times) })
}

/// Times have to grow: every step in a bag has one.
fn check_times(path: &Path, table: &Table, times: &[f64]) -> Result<(), BagError> {
    if let Some(row) = times.iter().position(|time| time.is_nan() || time.abs() > 9.2e9) {
        return Err(table.wrong(path, row, format!("{:?} is no time in s", times[row])));
    }
    match times.windows(2).position(|pair| pair[1] <= pair[0]) {
        Some(row) => {
            let (before, now) = (times[row], times[row + 1]);
            let what = match now == before {
                true => format!("the time {now:?} s stands in two rows; leave out what was recorded twice"),
                false => format!("time goes back from {before:?} to {now:?} s; cut the recording there"),
            };
            Err(table.wrong(path, row + 1, what))
        }
        None => Ok(()),
    }
}

/// A row is a step.
fn record(bag: &Path, header: &BagHeader, times: &[f64], sources: &[(usize, &ColumnMap, &[f64])], overwrite: bool) -> Result<(), BagError> {
    let mut recorder = Recorder::create(bag, header, &RecorderOptions { overwrite, ..RecorderOptions::lockstep() })?;
    for (row, time) in times.iter().enumerate() {
        let mut samples: Vec<Sample> = header.topics.iter().map(|info| Sample::new(info.axes.len())).collect();
        samples[0].position[0] = *time;
        for (place, map, column) in sources {
            let sample = &mut samples[*place];
            let values = match map.quantity {
                Quantity::Position => &mut sample.position,
                Quantity::Velocity => &mut sample.velocity,
                Quantity::Effort => &mut sample.effort,
            };
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
    Ok(())
}

fn topic_info(name: &str, axis: &str) -> TopicInfo {
    let topic = Topic { name: name.to_owned(), kind: Kind::Sample };
    TopicInfo { topic, axes: vec![axis.to_owned()], publisher: "import".to_owned() }
}

fn default_maps(names: &[&str], time: &str) -> Vec<ColumnMap> {
    let map = |column: &&str| {
        let (column, topic) = ((*column).to_owned(), topic_of(column));
        ColumnMap { column, topic, quantity: Quantity::Position, axis: 0, scale: 1.0, offset: 0.0 }
    };
    names.iter().filter(|name| **name != time).map(map).collect()
}
