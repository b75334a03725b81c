//! Bags become the episodes of a dataset.

use super::contract::{CommandedAt, Contract, Role};
use super::statistics::{Feature, written};
use crate::number_type::NumberType;
use crate::parquet_writer::{Values, Written, write};
use crate::table::{Cells, Table, table_of};
use crate::{BagError, Reader};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Steps may differ by this much from those of an even clock, s; lerobot itself refuses more.
const TOLERANCE_S: f64 = 1e-4;

/// What was written.
#[derive(Debug, Clone, PartialEq)]
pub struct LerobotReport {
    /// Rows of all episodes.
    pub rows: u64,
    /// Frames a second.
    pub fps: f64,
    /// Joints, by the dataset's names.
    pub joints: Vec<String>,
    /// What a person should know: a sentence each.
    pub notes: Vec<String>,
}

/// An episode, ready to be written.
struct Prepared {
    rows: usize,
    fps: f64,
    /// Features in the order of [`Role::ALL`]; of each the numbers of a row one after the other.
    features: Vec<Option<Vec<f64>>>,
}

/// Writes bags, an episode each, as a dataset into a folder that is there and empty. Columns `JOINT.position` make the feature `observation.state`,
/// `JOINT.command` `action`, and so on, by the contract, in its units. Features are single precision where that loses nothing, else double. `task` is what the
/// arm was to do.
///
/// # Errors
/// A bag has no columns of joints, others than the first, gaps, an uneven clock or another rate; the contract has targets in the row before; the files cannot be written.
pub fn export_lerobot(bags: &[Reader], folder: &Path, contract: &Contract, task: &str) -> Result<LerobotReport, BagError> {
    if contract.commanded_at == CommandedAt::Next {
        return Err(BagError::Usage(
            "contract: commanded_at: a dataset is written with \"frame\" alone, the target of a row at the row's time".to_owned(),
        ));
    }
    let mut joints: Option<Vec<String>> = None;
    let (mut episodes, mut notes) = (Vec::new(), Vec::new());
    for reader in bags {
        let table = table_of(reader, None)?;
        let found = joints_of(reader.path(), &table)?;
        let expected = joints.get_or_insert_with(|| found.clone());
        if *expected != found {
            let what = format!("has the joints {}, the bag before {}", found.join(", "), expected.join(", "));
            return Err(BagError::File { path: reader.path().to_owned(), what });
        }
        let episode = prepare(reader.path(), &table, &found, contract, &mut notes)?;
        let first: &Prepared = episodes.first().unwrap_or(&episode);
        if first.fps != episode.fps {
            let what = format!("has {} frames a second, the bag before {}; a dataset has one rate", episode.fps, first.fps);
            return Err(BagError::File { path: reader.path().to_owned(), what });
        }
        if Role::ALL.iter().enumerate().any(|(place, _)| first.features[place].is_some() != episode.features[place].is_some()) {
            let what = "has other columns of its joints than the bag before; the episodes of a dataset have the same".to_owned();
            return Err(BagError::File { path: reader.path().to_owned(), what });
        }
        episodes.push(episode);
    }
    let Some(fps) = episodes.first().map(|episode| episode.fps) else {
        return Err(BagError::Usage("a dataset needs at least one bag".to_owned()));
    };
    let outer = |joint: &String| contract.joints.iter().find(|(_, ours)| *ours == joint).map_or(joint, |(theirs, _)| theirs).clone();
    let joints: Vec<String> = joints.unwrap_or_default().iter().map(outer).collect();
    write_all(folder, contract, &joints, &episodes, fps, task)?;
    let rows = episodes.iter().map(|episode| episode.rows as u64).sum();
    Ok(LerobotReport { rows, fps, joints, notes })
}

/// The joints of which there is a position, in order.
fn joints_of(path: &Path, table: &Table) -> Result<Vec<String>, BagError> {
    let joints: Vec<String> = table.columns.iter().filter_map(|column| column.name.strip_suffix(".position")).map(str::to_owned).collect();
    if joints.is_empty() {
        let names: Vec<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
        let what = format!("has no columns JOINT.position, which a dataset is made of; it has {}", names.join(", "));
        return Err(BagError::File { path: path.to_owned(), what });
    }
    Ok(joints)
}

fn prepare(path: &Path, table: &Table, joints: &[String], contract: &Contract, notes: &mut Vec<String>) -> Result<Prepared, BagError> {
    let wrong = |what: String| BagError::File { path: path.to_owned(), what };
    let find = |name: &str| {
        table.columns.iter().find(|column| column.name == name).and_then(|column| match &column.cells {
            Cells::Numbers(values, _) => Some(values.as_slice()),
            _ => None,
        })
    };
    let times = find("t").unwrap_or_default();
    let fps = rate(times).map_err(wrong)?;
    let begin = times.first().copied().unwrap_or(0.0);
    if begin != 0.0 {
        notes.push(format!("{}: begins at {begin:?} s; episodes of a dataset begin at 0", path.display()));
    }
    let mut used = vec!["t".to_owned()];
    let mut features = Vec::with_capacity(Role::ALL.len());
    for role in Role::ALL {
        let names: Vec<String> = joints.iter().map(|joint| format!("{joint}.{}", role.name())).collect();
        let columns: Vec<Option<&[f64]>> = names.iter().map(|name| find(name)).collect();
        let is_there = columns.iter().any(Option::is_some);
        if let (true, Some(place)) = (is_there, columns.iter().position(Option::is_none)) {
            return Err(wrong(format!("has no column {:?}, and others of its kind; a feature of a dataset has all joints", names[place])));
        }
        if !is_there || contract.feature(role).is_none() {
            features.push(None);
            continue;
        }
        let mut flat = Vec::with_capacity(times.len() * joints.len());
        let theirs = |joint: &String| {
            contract.joints.iter().find(|(_, ours)| *ours == joint).map_or(joint.as_str(), |(theirs, _)| theirs.as_str()).to_owned()
        };
        let scales =
            joints.iter().map(|joint| contract.scale(role, &theirs(joint)).map_err(BagError::Usage)).collect::<Result<Vec<_>, _>>()?;
        for row in 0..times.len() {
            for ((column, scale), name) in columns.iter().flatten().zip(&scales).zip(&names) {
                if column[row].is_nan() {
                    return Err(wrong(format!("row {}: column {name:?} has no number; leave such rows out", row + 1)));
                }
                flat.push(column[row] / scale);
            }
        }
        used.extend(names);
        features.push(Some(flat));
    }
    let others: Vec<&str> =
        table.columns.iter().map(|column| column.name.as_str()).filter(|name| !used.iter().any(|used| used == name)).collect();
    if !others.is_empty() {
        notes.push(format!("{}: omitted, because they do not belong to a joint: {}", path.display(), others.join(", ")));
    }
    Ok(Prepared { rows: times.len(), fps, features })
}

/// Frames a second of an even clock: a whole number where it is one but for rounding.
fn rate(times: &[f64]) -> Result<f64, String> {
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return Err("has no rows".to_owned()) };
    if times.len() < 2 {
        return Err("has one row, which has no rate".to_owned());
    }
    let measured = (times.len() - 1) as f64 / (last - first);
    // The shortest number of frames a second that is the same but for rounding.
    let short = |digits: i32| (measured * 10f64.powi(digits)).round() / 10f64.powi(digits);
    let is_same = |fps: &f64, within: f64| *fps > 0.0 && (fps / measured - 1.0).abs() < within;
    let whole = Some(short(0)).filter(|fps| is_same(fps, 1e-6));
    let fps = whole.or_else(|| (1..=6).map(short).find(|fps| is_same(fps, 1e-9))).unwrap_or(measured);
    let late = |row: usize| (times[row] - first - row as f64 / fps).abs();
    let Some(row) = (0..times.len()).find(|row| late(*row) > TOLERANCE_S) else { return Ok(fps) };
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted[(sorted.len() - 1) / 2];
    let advice = "a LeRobot dataset has one rate and no gaps: cut the recording there, or resample it";
    match steps.iter().position(|step| (step - usual).abs() > TOLERANCE_S) {
        Some(odd) => Err(format!("row {}: {:.6} s behind the row before, where {usual:.6} s are usual; {advice}", odd + 2, steps[odd])),
        None => Err(format!("row {}: its time is {:.6} s off an even clock of {fps} frames a second; {advice}", row + 1, late(row))),
    }
}

fn write_all(folder: &Path, contract: &Contract, joints: &[String], episodes: &[Prepared], fps: f64, task: &str) -> Result<(), BagError> {
    let made = |path: &str| {
        let path = folder.join(path);
        std::fs::create_dir_all(&path).map_err(|source| BagError::Create { path: path.clone(), source })?;
        Ok::<_, BagError>(path)
    };
    let (meta, data, told) = (made("meta")?, made("data/chunk-000")?, made("meta/episodes/chunk-000")?);
    let (mut features, mut columns) = (Map::new(), Vec::new());
    let joined: Vec<(Role, Vec<f64>)> = Role::ALL
        .into_iter()
        .enumerate()
        .filter(|(place, _)| episodes.first().is_some_and(|episode| episode.features[*place].is_some()))
        .map(|(place, role)| (role, episodes.iter().filter_map(|episode| episode.features[place].as_deref()).flatten().copied().collect()))
        .collect();
    let names: Vec<String> = joints.iter().map(|joint| format!("{joint}.pos")).collect();
    for (role, values) in &joined {
        let Some(feature) = contract.feature(*role) else { continue };
        let of = if is_single(values) { NumberType::Single } else { NumberType::Double };
        let dtype = if of == NumberType::Single { "float32" } else { "float64" };
        features.insert(feature.to_owned(), json!({ "dtype": dtype, "shape": [joints.len()], "names": names }));
        // lerobot reads a list of one as a number.
        let values = if joints.len() == 1 { Values::Numbers(values, of) } else { Values::Lists(values, joints.len(), of) };
        columns.push(Written { name: feature.to_owned(), values });
    }
    let rows: Vec<usize> = episodes.iter().map(|episode| episode.rows).collect();
    let total: usize = rows.iter().sum();
    let frames: Vec<f64> = rows.iter().flat_map(|rows| (0..*rows).map(|frame| frame as f64)).collect();
    let stamps: Vec<f64> = frames.iter().map(|frame| frame / fps).collect();
    let of: Vec<f64> = rows.iter().enumerate().flat_map(|(episode, rows)| std::iter::repeat_n(episode as f64, *rows)).collect();
    let index: Vec<f64> = (0..total).map(|row| row as f64).collect();
    let tasks = vec![0.0; total];
    let whole = [("frame_index", &frames), ("episode_index", &of), ("index", &index), ("task_index", &tasks)];
    features.insert("timestamp".to_owned(), json!({ "dtype": "float32", "shape": [1], "names": null }));
    columns.push(Written { name: "timestamp".to_owned(), values: Values::Numbers(&stamps, NumberType::Single) });
    for (name, values) in whole {
        features.insert(name.to_owned(), json!({ "dtype": "int64", "shape": [1], "names": null }));
        columns.push(Written { name: name.to_owned(), values: Values::Numbers(values, NumberType::Int64) });
    }
    write(&data.join("file-000.parquet"), &columns, &[])?;
    let described: Vec<Feature> = columns.iter().filter_map(feature_of).collect();
    let stats: Map<String, Value> = described.iter().map(|feature| (feature.name.to_owned(), feature.of_dataset())).collect();
    write_episodes(&told.join("file-000.parquet"), &rows, task, &described)?;
    write_tasks(&meta.join("tasks.parquet"), task)?;
    // A whole number of frames a second is written as one.
    let fps = if fps.fract() == 0.0 && fps < 1e9 { json!(fps as u64) } else { json!(fps) };
    let info = json!({
        "codebase_version": "v3.0", "robot_type": null, "total_episodes": rows.len(), "total_frames": total, "total_tasks": 1, "chunks_size": 1000,
        "data_files_size_in_mb": 100, "video_files_size_in_mb": 200, "fps": fps, "splits": { "train": format!("0:{}", rows.len()) },
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "video_path": null, "features": features,
    });
    for (name, value) in [("info.json", &info), ("stats.json", &Value::Object(stats))] {
        let path = meta.join(name);
        let text = serde_json::to_string_pretty(value).map_err(|error| BagError::File { path: path.clone(), what: error.to_string() })?;
        std::fs::write(&path, text).map_err(|source| BagError::Create { path, source })?;
    }
    Ok(())
}

/// A column of the data as a feature with statistics.
fn feature_of<'a>(column: &'a Written) -> Option<Feature<'a>> {
    let (values, width) = match column.values {
        Values::Numbers(values, _) => (values, 1),
        Values::Lists(values, width, _) => (values, width),
        Values::Texts(_) | Values::TextLists(_) => return None,
    };
    Some(Feature { name: &column.name, values, width })
}

/// Which rows of the data are of which episode, and the statistics of each.
fn write_episodes(out: &Path, rows: &[usize], task: &str, features: &[Feature]) -> Result<(), BagError> {
    let ends: Vec<f64> = rows
        .iter()
        .scan(0, |end, rows| {
            *end += rows;
            Some(*end as f64)
        })
        .collect();
    let lengths: Vec<f64> = rows.iter().map(|rows| *rows as f64).collect();
    let starts: Vec<f64> = ends.iter().zip(&lengths).map(|(end, length)| end - length).collect();
    let (numbers, zeros): (Vec<f64>, Vec<f64>) = ((0..rows.len()).map(|episode| episode as f64).collect(), vec![0.0; rows.len()]);
    let whole = |name: &str, values| Written { name: name.to_owned(), values: Values::Numbers(values, NumberType::Int64) };
    let stats: Vec<_> = features.iter().flat_map(|feature| feature.of_episodes(rows)).collect();
    let mut columns = vec![
        whole("episode_index", &numbers),
        Written { name: "tasks".to_owned(), values: Values::TextLists(vec![task.to_owned(); rows.len()]) },
        whole("length", &lengths),
        whole("data/chunk_index", &zeros),
        whole("data/file_index", &zeros),
        whole("dataset_from_index", &starts),
        whole("dataset_to_index", &ends),
    ];
    columns.extend(written(&stats));
    columns.extend([whole("meta/episodes/chunk_index", &zeros), whole("meta/episodes/file_index", &zeros)]);
    write(out, &columns, &[])
}

/// The tasks, as pandas writes a frame whose index they are.
fn write_tasks(out: &Path, task: &str) -> Result<(), BagError> {
    let text = |name: Value, field: Value| json!({ "name": name, "field_name": field, "pandas_type": "unicode", "numpy_type": "object", "metadata": null });
    let number =
        json!({ "name": "task_index", "field_name": "task_index", "pandas_type": "int64", "numpy_type": "int64", "metadata": null });
    let pandas = json!({
        "index_columns": ["task"], "column_indexes": [text(Value::Null, Value::Null)], "columns": [number, text(json!("task"), json!("task"))],
        "creator": { "library": "backdrive", "version": env!("CARGO_PKG_VERSION") }, "pandas_version": "2.0.0",
    });
    let columns = [
        Written { name: "task_index".to_owned(), values: Values::Numbers(&[0.0], NumberType::Int64) },
        Written { name: "task".to_owned(), values: Values::Texts(vec![task.to_owned()]) },
    ];
    write(out, &columns, &[("pandas", pandas.to_string())])
}

/// Whether single precision loses nothing but what a change of units and back has left.
fn is_single(values: &[f64]) -> bool {
    values.iter().all(|value| (f64::from(*value as f32) - value).abs() <= 4.0 * f64::EPSILON * value.abs())
}
