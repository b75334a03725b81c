//! Sources become recordings: files opened by the one reading layer of the bags, the times found, signals put on an even clock.

use crate::names;
use crate::numeric::{extremes, median};
use crate::quantity::Quantity;
use crate::recording::{Recording, Signal, Stream};
use crate::source::{InspectError, Options, Source};
use crate::time::{Found, find};
use backdrive_bags::{
    ImportOptions, LerobotOptions, RawColumn, RawRecording, RawStream, Reader, TableFormat, is_lerobot, is_rosbag, raw_bag, raw_lerobot,
    raw_table, shell_word,
};
use backdrive_diagnosis::recordings::noise;
use backdrive_plant::model::Hold;
use backdrive_plant::recording::{resample, units};
use std::path::{Path, PathBuf};

/// Most samples of the even clock; what is longer is thinned to as many.
const MOST_SAMPLES: usize = 200_000;
/// A step of a clock that differs from the usual one by less than this share of it is even.
const EVEN: f64 = 0.01;
/// Fewest samples that say anything about a signal.
const LEAST_SAMPLES: usize = 20;

/// Reads all recordings of some sources.
///
/// # Errors
/// A file is missing, damaged or of a format that is not read; a table has no times.
pub fn recordings(sources: &[Source], options: &Options) -> Result<Vec<Recording>, InspectError> {
    let mut out = Vec::new();
    for source in sources {
        match source {
            Source::Path(path) => of_path(path, options, &mut out)?,
            Source::Columns { name, columns } => {
                let column = |(heading, values): &(String, Vec<f64>)| {
                    let (text, unit) = units::split(heading);
                    let unit = unit.and_then(|unit| units::parse(unit).ok());
                    RawColumn { name: text.to_string(), unit, values: values.clone(), other: None }
                };
                let stream = RawStream { columns: columns.iter().map(column).collect(), ..RawStream::default() };
                out.extend(made(name, RawRecording { streams: vec![stream], ..RawRecording::default() }, options)?);
            }
        }
    }
    Ok(out)
}

fn of_path(path: &Path, options: &Options, out: &mut Vec<Recording>) -> Result<(), InspectError> {
    let file = path.display().to_string();
    if !path.exists() {
        return Err(InspectError::of(&file, "there is no such file or folder"));
    }
    if is_lerobot(path) {
        for raw in raw_lerobot(path, &LerobotOptions::default())? {
            let name = format!("{file} ({})", raw.episode);
            out.extend(made(&name, raw, options)?);
        }
        return Ok(());
    }
    if is_rosbag(path) {
        let word = shell_word(&file);
        let what = format!("is a ROS bag; convert it to MCAP first: backdrive bag import {word} --bag {}.mcap", word.trim_end_matches('/'));
        return Err(InspectError::of(&file, what));
    }
    if path.is_dir() {
        let files = files_in(path)?;
        if files.is_empty() {
            return Err(InspectError::of(&file, "holds no recordings (.csv, .mcap, .npz, .mat, .parquet, a LeRobot dataset)"));
        }
        return files.iter().try_for_each(|path| of_path(path, options, out));
    }
    let raw = match is_mcap(path) {
        true => raw_bag(&Reader::open(path)?)?,
        false => raw_table(path, &ImportOptions { headings: options.columns.clone(), ..ImportOptions::default() })?,
    };
    out.extend(made(&file, raw, options)?);
    Ok(())
}

fn is_mcap(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"))
}

fn files_in(folder: &Path) -> Result<Vec<PathBuf>, InspectError> {
    let failed = |e: std::io::Error| InspectError::of(&folder.display().to_string(), format!("cannot be read: {e}"));
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if (path.is_file() && (is_mcap(&path) || TableFormat::of_ending(&path).is_some())) || is_lerobot(&path) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// A recording of what was read; several where a table holds several runs.
fn made(file: &str, raw: RawRecording, options: &Options) -> Result<Vec<Recording>, InspectError> {
    let mut recording = Recording { file: file.to_string(), notes: raw.notes, ..Recording::default() };
    for stream in raw.streams {
        add(&mut recording, stream, options)?;
    }
    let pieces = crate::runs::parted(recording);
    let mut out = Vec::new();
    for mut piece in pieces {
        if piece.streams.iter().all(|stream| stream.times.len() < LEAST_SAMPLES) {
            let rows = piece.streams.iter().map(|stream| stream.times.len()).max().unwrap_or(0);
            return Err(InspectError::of(&piece.file, format!("has {rows} rows; at least {LEAST_SAMPLES} are needed")));
        }
        even(&mut piece);
        out.push(piece);
    }
    Ok(out)
}

fn add(recording: &mut Recording, raw: RawStream, options: &Options) -> Result<(), InspectError> {
    let place = recording.streams.len();
    let (mut times, mut time) = (raw.stamps.clone(), None);
    if times.is_none() {
        match find(&raw.columns, options).map_err(|what| InspectError::of(&recording.file, what))? {
            Found::Column { place, seconds, note, heading } => {
                times = Some(seconds);
                recording.notes.extend(note);
                recording.time = Some(heading);
                time = Some(place);
            }
            Found::Rate(rate) => {
                let rows = raw.columns.iter().map(|column| column.values.len()).max().unwrap_or(0);
                times = Some((0..rows).map(|row| row as f64 / rate).collect());
            }
        }
    }
    let times = times.unwrap_or_default();
    for (index, column) in raw.columns.into_iter().enumerate() {
        if Some(index) == time || (column.values.len() != times.len() && column.other.is_none()) {
            continue;
        }
        let named = names::read(&column.name, &raw.topic);
        let is_field = !raw.topic.is_empty();
        recording.signals.push(Signal {
            name: if is_field { format!("{}.{}", raw.topic, column.name) } else { column.name.clone() },
            field: is_field.then(|| column.name.clone()),
            stream: place,
            stated: column.unit,
            hint: named.hint,
            quantity: named.quantity.unwrap_or(Quantity::Unknown),
            sure: 0.0,
            why: String::new(),
            side: named.side,
            joint: named.joint,
            values: column.values,
            even: Vec::new(),
            noise: 0.0,
            step: 0.0,
            other: column.other,
        });
    }
    recording.streams.push(Stream { topic: raw.topic, times, logged: raw.logged, lines: raw.lines });
    Ok(())
}

/// Puts every signal on one even clock: the fastest stream's, over the time that all streams cover.
fn even(recording: &mut Recording) {
    let usual = |stream: &Stream| {
        let steps: Vec<f64> = stream.times.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).collect();
        median(&steps)
    };
    let long = || recording.streams.iter().filter(|stream| stream.times.len() >= LEAST_SAMPLES);
    let period = long().map(usual).filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
    let bounds: Vec<(f64, f64)> = long().filter_map(|stream| extremes(&stream.times)).collect();
    let first = bounds.iter().map(|b| b.0).fold(f64::NEG_INFINITY, f64::max);
    let last = bounds.iter().map(|b| b.1).fold(f64::INFINITY, f64::min);
    if !(period.is_finite() && last > first) {
        return;
    }
    let count = ((last - first) / period + 1e-6).floor() as usize + 1;
    let stride = count.div_ceil(MOST_SAMPLES);
    recording.period = period * stride as f64;
    let single = recording.streams.len() == 1 && stride == 1;
    let grid: Vec<f64> = (0..count.div_ceil(stride)).map(|i| first + i as f64 * recording.period).collect();
    for signal in &mut recording.signals {
        even_signal(signal, &recording.streams, single, period, &grid);
        signal.noise = noise::white(&signal.even).filter(|noise| noise.is_finite()).unwrap_or(0.0);
        signal.step = noise::step_of(&signal.even).unwrap_or(0.0);
    }
}

fn even_signal(signal: &mut Signal, streams: &[Stream], single: bool, period: f64, grid: &[f64]) {
    let (factor, is_finite) = (signal.factor(), |x: &f64| x.is_finite());
    let times = &streams[signal.stream].times;
    let is_even = single && times.windows(2).all(|w| (w[1] - w[0] - period).abs() < EVEN * period);
    if signal.values.len() < LEAST_SAMPLES || signal.values.iter().filter(|x| is_finite(x)).count() < LEAST_SAMPLES {
        return;
    }
    if is_even && signal.values.iter().all(is_finite) {
        signal.even = signal.values.iter().map(|x| x * factor).collect();
        return;
    }
    let (mut at, mut values, mut latest) = (Vec::new(), Vec::new(), f64::NEG_INFINITY);
    for (time, value) in times.iter().zip(&signal.values) {
        if *time > latest && value.is_finite() {
            at.push(*time);
            values.push(value * factor);
            latest = *time;
        }
    }
    // A command is held until the next one; what a sensor measures goes on between its samples.
    let hold = if signal.quantity == Quantity::Command && !single { Hold::Zero } else { Hold::Linear };
    if at.len() >= LEAST_SAMPLES {
        signal.even = resample(hold, &at, &values, grid);
    }
}
