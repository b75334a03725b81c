//! Picks the columns of a recording out of a bag.

use crate::cdr::{FieldPath, Schema};
use crate::{BagError, Clock, Reader};
use backdrive_msgs::topic::Kind;
use backdrive_plant::model::Hold;
use backdrive_plant::recording::resample;
use serde::Serialize;
use std::collections::HashMap;

/// Topic of an imported bag that has the times of its rows.
pub(crate) const TIME_TOPIC: &str = "/recording/t";

/// A column that is wanted: `scale * value + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    /// Name of the column.
    pub name: String,
    /// The topic that has it.
    pub topic: String,
    /// Where in a message of the topic: `effort[0]`, `effort[elbow]`, `wrench.force.x`.
    pub field: String,
    /// Factor.
    pub scale: f64,
    /// Then added.
    pub offset: f64,
    /// Between its samples.
    pub hold: Hold,
}

impl Signal {
    /// A field, unchanged.
    pub fn new(name: &str, topic: &str, field: &str) -> Signal {
        let (name, topic, field) = (name.to_owned(), topic.to_owned(), field.to_owned());
        Signal { name, topic, field, scale: 1.0, offset: 0.0, hold: Hold::Linear }
    }
}

/// Columns of equal length.
#[derive(Debug, Clone, PartialEq)]
pub struct Signals {
    /// Time of each row, s.
    pub t: Vec<f64>,
    /// Step of each row, if the messages have steps.
    pub steps: Option<Vec<u64>>,
    /// Names of the columns.
    pub names: Vec<String>,
    /// A value per row for every name; NaN where it was not measured or the message is missing.
    pub columns: Vec<Vec<f64>>,
    /// How well the signals fit together.
    pub alignment: Alignment,
}

/// How well the signals fit together.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Alignment {
    /// Rows are steps; otherwise times of the most frequent signal, at which the others are interpolated.
    pub by_step: bool,
    /// Rows per column that have no value.
    pub missing: Vec<u64>,
    /// Steps that no signal has, or intervals longer than one and a half times the usual one.
    pub gaps: u64,
    /// Largest deviation of a row's stamp from evenly spaced time, s; 0 when rows are steps.
    pub jitter_s: f64,
    /// Messages out of order or at the same time as another.
    pub disordered: u64,
}

/// What is known of one signal: when and what.
#[derive(Default)]
pub(crate) struct Series {
    steps: Vec<u64>,
    /// Stamp, or log time without one; s from the first message.
    pub(crate) times: Vec<f64>,
    /// Log time, s from the first message.
    pub(crate) logged: Vec<f64>,
    pub(crate) values: Vec<f64>,
    /// Some message had no step.
    stepless: bool,
}

/// Reads signals, aligned by step where their messages have one, else by header stamp (or, without a header, log time).
///
/// Rows run over the time that all signals cover. In a run at a known rate t = step / rate; in a bag that was
/// imported from a table t is the table's.
///
/// Errors: a topic or field that is not there, a damaged bag, no message at all.
pub fn signals(reader: &Reader, wanted: &[Signal]) -> Result<Signals, BagError> {
    gather(reader, wanted, true, usize::MAX)
}

/// As [`signals`]; without `trim` over all steps that any signal has, or all times at which each topic has messages. No further than where the first
/// signal has more than `most` samples.
pub(crate) fn gather(reader: &Reader, wanted: &[Signal], trim: bool, most: usize) -> Result<Signals, BagError> {
    let Gathered { mut series, clock, sparse } = series_of(reader, wanted, most)?;
    for (signal, series) in wanted.iter().zip(&mut series) {
        if series.times.is_empty() {
            return Err(BagError::Field {
                topic: signal.topic.clone(),
                field: signal.field.clone(),
                what: "the topic has no message".to_owned(),
            });
        }
        if (signal.scale, signal.offset) != (1.0, 0.0) {
            series.values.iter_mut().for_each(|value| *value = signal.scale * *value + signal.offset);
        }
    }
    if series.is_empty() {
        return Err(BagError::Usage("no signal was asked for".to_owned()));
    }
    let mut found = if series.iter().all(|series| !series.stepless) {
        by_step(&series, &sparse, trim, reader.header().map_or(0.0, |header| header.rate_hz), clock)
    } else {
        by_time(wanted, &series, trim)
    };
    found.names = wanted.iter().map(|signal| signal.name.clone()).collect();
    found.alignment.missing = found.columns.iter().map(|column| column.iter().filter(|value| value.is_nan()).count() as u64).collect();
    Ok(found)
}

/// The messages' values of each wanted signal, in the order of the file, before anything is aligned.
pub(crate) struct Gathered {
    pub(crate) series: Vec<Series>,
    /// Of an imported bag, the exact times of its rows.
    pub(crate) clock: Option<Series>,
    /// Whether a signal speaks now and then.
    sparse: Vec<bool>,
}

/// Reads the wanted signals, no further than where one has more than `most` samples.
pub(crate) fn series_of(reader: &Reader, wanted: &[Signal], most: usize) -> Result<Gathered, BagError> {
    let mut plans: HashMap<u16, Plan> = HashMap::new();
    let mut sparse = vec![false; wanted.len()];
    let imported = reader.header().is_some_and(|header| header.clock == Clock::Imported);
    let clock = (imported && reader.topic(TIME_TOPIC).is_ok()).then(|| Signal::new("t", TIME_TOPIC, "position[0]"));
    for (place, signal) in wanted.iter().chain(&clock).enumerate() {
        let topic = reader.topic(&signal.topic)?;
        let plan = match plans.entry(topic.channel) {
            std::collections::hash_map::Entry::Occupied(plan) => plan.into_mut(),
            std::collections::hash_map::Entry::Vacant(vacant) => {
                let schema = topic.parse_schema()?;
                // Where the bag states the axes, they are the same in every message.
                let may_change = topic.axes.is_empty() && schema.name_list().is_some();
                let stamp = schema.stamp();
                vacant.insert(Plan { stamp, schema, fields: Vec::new(), joints: may_change.then(Vec::new) })
            }
        };
        let field = plan.schema.find(&signal.field);
        let wrong = |what| BagError::Field { topic: signal.topic.clone(), field: signal.field.clone(), what };
        plan.fields.push((place, field.map_err(wrong)?));
        if let Some(sparse) = sparse.get_mut(place) {
            *sparse = topic.kind.is_some_and(|kind| kind != Kind::Sample);
        }
    }
    let mut series: Vec<Series> = wanted.iter().chain(&clock).map(|_| Series::default()).collect();
    let (mut begin, mut full) = (None, false);
    for entry in reader.messages()? {
        let entry = entry?;
        let Some(plan) = plans.get_mut(&entry.topic.channel) else { continue };
        let step = entry.message(reader.path())?.map(|message| message.step());
        let wrong = |field: &FieldPath, what| BagError::Field { topic: entry.topic.name.clone(), field: field.to_string(), what };
        if let Some((before, (_, path))) = plan.joints.as_mut().zip(plan.fields.iter().find(|(_, path)| path.is_by_place())) {
            let joints = plan.schema.joint_names(&entry.payload).map_err(|what| wrong(path, what))?;
            if before.is_empty() {
                *before = joints;
            } else if !joints.is_empty() && joints != *before {
                return Err(wrong(path, joints_change(before, &joints, path)));
            }
        }
        let stamp = match &plan.stamp {
            Some(path) => plan.schema.read_time_ns(path, &entry.payload).map_err(|what| wrong(path, what))?,
            None => None,
        };
        // A stamp that was not filled in is 0.
        let ns = stamp.filter(|stamp| *stamp != 0 || step.is_some()).unwrap_or(entry.log_time_ns as i64);
        // Seconds since 1970 would leave only 0.2 µs of a double; seconds since the first message are exact to the ns.
        let begin = *begin.get_or_insert(ns);
        let time = ns.saturating_sub(begin) as f64 / 1e9;
        let logged = (entry.log_time_ns as i64).saturating_sub(begin) as f64 / 1e9;
        for (place, path) in &plan.fields {
            let value = plan.schema.read(path, &entry.payload).map_err(|what| wrong(path, what))?;
            let series = &mut series[*place];
            series.stepless |= step.is_none();
            series.steps.push(step.unwrap_or(0));
            series.times.push(time);
            series.logged.push(logged);
            series.values.push(value.unwrap_or(f64::NAN));
            full |= series.times.len() > most;
        }
        if full {
            break;
        }
    }
    let clock = clock.and_then(|_| series.pop());
    Ok(Gathered { series, clock, sparse })
}

struct Plan {
    schema: Schema,
    stamp: Option<FieldPath>,
    /// Place of the signal, and where it stands in a message.
    fields: Vec<(usize, FieldPath)>,
    /// The joints of its first message, where they may be others in the next.
    joints: Option<Vec<String>>,
}

fn joints_change(before: &[String], now: &[String], path: &FieldPath) -> String {
    let list = path.to_string().split('[').next().unwrap_or_default().to_owned();
    let first = before.first().map_or("", String::as_str);
    let (before, now) = (before.join(", "), now.join(", "));
    format!("its messages have their joints in different places ({before}; {now}): name the joint, as in {list}[{first}]")
}

fn by_step(series: &[Series], sparse: &[bool], trim: bool, rate_hz: f64, clock: Option<Series>) -> Signals {
    // Topics that publish now and then have a value at every step: the last one.
    let all_sparse = sparse.iter().all(|sparse| *sparse);
    let dense = || series.iter().zip(sparse).filter(|(_, sparse)| all_sparse || !**sparse).map(|(series, _)| series);
    let mut steps: Vec<u64> = dense().flat_map(|series| series.steps.iter().copied()).collect();
    steps.sort_unstable();
    steps.dedup();
    if trim {
        let first = dense().filter_map(|series| series.steps.iter().min()).max().copied().unwrap_or(0);
        let last = dense().filter_map(|series| series.steps.iter().max()).min().copied().unwrap_or(0);
        steps.retain(|step| (first..=last).contains(step));
    }
    let mut alignment = Alignment { by_step: true, ..Alignment::default() };
    alignment.gaps = steps.windows(2).map(|pair| pair[1] - pair[0] - 1).sum();
    let columns = series
        .iter()
        .zip(sparse)
        .map(|(series, sparse)| {
            alignment.disordered += series.steps.windows(2).filter(|pair| pair[1] <= pair[0]).count() as u64;
            let mut order: Vec<usize> = (0..series.steps.len()).collect();
            order.sort_by_key(|index| series.steps[*index]); // stable: of two at one step the later counts
            let (mut next, mut value) = (0, f64::NAN);
            let column = steps.iter().map(|step| {
                if !*sparse {
                    value = f64::NAN;
                }
                while let Some(index) = order.get(next).filter(|index| series.steps[**index] <= *step) {
                    if *sparse || series.steps[*index] == *step {
                        value = series.values[*index];
                    }
                    next += 1;
                }
                value
            });
            column.collect()
        })
        .collect();
    let told: HashMap<u64, f64> = match clock {
        Some(clock) => clock.steps.into_iter().zip(clock.values).collect(),
        // Without a rate, the stamps of the messages themselves.
        None if rate_hz <= 0.0 => dense().flat_map(|series| series.steps.iter().copied().zip(series.times.iter().copied())).collect(),
        None => HashMap::new(),
    };
    let t = steps.iter().map(|step| told.get(step).copied().unwrap_or(*step as f64 / rate_hz)).collect();
    Signals { t, steps: Some(steps), names: Vec::new(), columns, alignment }
}

fn by_time(wanted: &[Signal], series: &[Series], trim: bool) -> Signals {
    let mut alignment = Alignment::default();
    // When its topic has messages: a field that some of them lack shortens nothing.
    let messages: Vec<Vec<f64>> = series
        .iter()
        .map(|series| {
            let mut times = series.times.clone();
            times.sort_by(f64::total_cmp);
            times.dedup();
            times
        })
        .collect();
    let sorted: Vec<(Vec<f64>, Vec<f64>)> = series
        .iter()
        .map(|series| {
            let mut points: Vec<(f64, f64)> = series.times.iter().copied().zip(series.values.iter().copied()).collect();
            alignment.disordered += points.windows(2).filter(|pair| pair[1].0 <= pair[0].0).count() as u64;
            points.retain(|point| !point.1.is_nan()); // between others, what was not measured is interpolated
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            points.dedup_by(|later, first| later.0 == first.0);
            points.into_iter().unzip()
        })
        .collect();
    // A signal without a single value does not bound the others, and stays empty.
    let spoken = || {
        let all = sorted.iter().zip(&messages).filter(|(points, _)| !points.0.is_empty());
        all.map(|(points, messages)| if trim { &points.0 } else { messages })
    };
    let first = spoken().map(|times| times[0]).fold(f64::NEG_INFINITY, f64::max);
    let last = spoken().map(|times| times[times.len() - 1]).fold(f64::INFINITY, f64::min);
    let within = |times: &Vec<f64>| times.iter().copied().filter(|time| (first..=last).contains(time)).collect::<Vec<f64>>();
    let times = spoken().map(within).max_by_key(Vec::len).unwrap_or_default();
    let column = |((at, values), signal): (&(Vec<f64>, Vec<f64>), &Signal)| match at.is_empty() {
        true => vec![f64::NAN; times.len()],
        // A bag keeps its own samples' bits.
        false if within(at) == times => {
            at.iter().zip(values).filter(|(time, _)| (first..=last).contains(time)).map(|point| *point.1).collect()
        }
        false => {
            let mut column = resample(signal.hold, at, values, &times);
            let (from, to) = (at[0], at[at.len() - 1]);
            column.iter_mut().zip(&times).filter(|(_, time)| !(from..=to).contains(*time)).for_each(|(value, _)| *value = f64::NAN);
            column
        }
    };
    let columns = sorted.iter().zip(wanted).map(column).collect();
    let mut intervals: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals.sort_by(f64::total_cmp);
    if let (Some(usual), [begin, .., end]) = (intervals.get(intervals.len() / 2), times.as_slice()) {
        alignment.gaps = intervals.iter().filter(|interval| **interval > 1.5 * usual).count() as u64;
        let spacing = (end - begin) / (times.len() - 1) as f64;
        alignment.jitter_s = times.iter().enumerate().map(|(i, time)| (time - begin - i as f64 * spacing).abs()).fold(0.0, f64::max);
    }
    let t = times.iter().map(|time| time - times[0]).collect();
    Signals { t, steps: None, names: Vec::new(), columns, alignment }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_that_some_messages_lack_shortens_no_exported_row() {
        let of = |present: std::ops::Range<usize>| {
            let times: Vec<f64> = (0..10).map(|row| 0.1 * row as f64).collect();
            let values = (0..10).map(|row| if present.contains(&row) { row as f64 } else { f64::NAN }).collect();
            Series { steps: vec![0; 10], logged: times.clone(), times, values, stepless: true }
        };
        let (wanted, series) = ([Signal::new("a", "/t", "a"), Signal::new("b", "/t", "b")], [of(0..10), of(3..8)]);
        let whole = by_time(&wanted, &series, false);
        assert_eq!((whole.t.len(), whole.alignment.gaps), (10, 0));
        assert_eq!(whole.columns[0], (0..10).map(f64::from).collect::<Vec<f64>>());
        let measured: Vec<usize> = (0..10).filter(|row| whole.columns[1][*row].is_finite()).collect();
        assert_eq!(measured, [3, 4, 5, 6, 7]);
        // A fit needs all of them in every row.
        assert_eq!(by_time(&wanted, &series, true).columns, [[3.0, 4.0, 5.0, 6.0, 7.0]; 2].map(Vec::from));
    }
}
