//! Episodes of a dataset become bags.

use super::contract::{CommandedAt, Contract, Role};
use super::info::Info;
use crate::memory::{MOST_BYTES, Memory};
use crate::number_type::NumberType;
use crate::parquet_file::ParquetFile;
use crate::table::{Column, ImportOptions, ImportReport, Table, write_bag};
use crate::{BagError, check_target};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// How a dataset becomes bags.
#[derive(Debug, Clone, PartialEq)]
pub struct LerobotOptions {
    /// What its features are.
    pub contract: Contract,
    /// Only these episodes; `None` for all.
    pub episodes: Option<Vec<u64>>,
    /// Replace bags that exist.
    pub overwrite: bool,
    /// Bytes that the unpacked numbers of the dataset may take, see [`crate::MOST_BYTES`].
    pub most_bytes: u64,
}

impl Default for LerobotOptions {
    fn default() -> LerobotOptions {
        LerobotOptions { contract: Contract::default(), episodes: None, overwrite: false, most_bytes: MOST_BYTES }
    }
}

/// An episode that was imported.
#[derive(Debug, Clone, PartialEq)]
pub struct Episode {
    /// `episode_000000` and so on.
    pub name: String,
    /// Its bag.
    pub bag: PathBuf,
    /// What was done.
    pub report: ImportReport,
}

/// Whether a path is the folder of a LeRobot dataset.
pub fn is_lerobot(path: &Path) -> bool {
    path.join("meta/info.json").is_file()
}

/// The rows of an episode: of each column the numbers of a row one after the other.
#[derive(Default)]
struct Rows {
    stamps: Vec<f64>,
    frames: Vec<f64>,
    /// By the place of their role among those that are there.
    features: Vec<Vec<f64>>,
}

/// Writes each episode of a dataset as a bag `episode_000000.mcap` and so on into a folder, with the columns `JOINT.position`, `JOINT.command` (rad), `JOINT.velocity`
/// (rad/s), `JOINT.effort` (N m), as far as the dataset has them.
///
/// Time is the frame's number over the dataset's rate where the stamps, which are single precision, say the same to their last digits; else the stamps.
///
/// # Errors
/// It is no dataset of version 3, has not the episodes or the positions, a file is damaged, a value is missing, a bag exists or cannot be written.
pub fn import_lerobot(folder: &Path, into: &Path, options: &LerobotOptions) -> Result<Vec<Episode>, BagError> {
    let tables = episode_tables(folder, options)?;
    std::fs::create_dir_all(into).map_err(|source| BagError::Create { path: into.to_owned(), source })?;
    let bag_of = |name: &str| into.join(format!("{name}.mcap"));
    for (name, _) in &tables {
        check_target(&bag_of(name), options.overwrite)?;
    }
    let mut done: Vec<Episode> = Vec::with_capacity(tables.len());
    for (name, table) in tables {
        let import = ImportOptions { overwrite: options.overwrite, ..ImportOptions::default() };
        let bag = bag_of(&name);
        // All episodes or none: some of them would look like all.
        let undo = |_: &BagError| done.iter().for_each(|episode| drop(std::fs::remove_file(&episode.bag)));
        let report = write_bag(&folder.join(&name), &table, &bag, &import).inspect_err(undo)?;
        done.push(Episode { name, bag, report });
    }
    Ok(done)
}

/// The episodes of a dataset as tables, `episode_000000` and so on, with the columns of [`import_lerobot`].
///
/// # Errors
/// As of [`import_lerobot`], but for what is written.
pub(crate) fn episode_tables(folder: &Path, options: &LerobotOptions) -> Result<Vec<(String, Table)>, BagError> {
    let info = Info::read(folder)?;
    let contract = &options.contract;
    let is_there = |role: &Role| contract.feature(*role).is_some_and(|feature| info.has(feature));
    let there: Vec<Role> = Role::ALL.into_iter().filter(is_there).collect();
    if there.first() != Some(&Role::Position) {
        return Err(info.no_feature(contract.feature(Role::Position).unwrap_or_default()));
    }
    let features: Vec<&str> = there.iter().filter_map(|role| contract.feature(*role)).collect();
    let joints = features.iter().map(|feature| info.joints(feature)).collect::<Result<Vec<_>, _>>()?;
    let widths: Vec<usize> = joints.iter().map(Vec::len).collect();
    // What the contract lacks is reported before anything is written.
    for (role, joints) in there.iter().zip(&joints) {
        joints.iter().try_for_each(|joint| contract.scale(*role, joint).map(drop)).map_err(BagError::Usage)?;
    }
    let all: BTreeSet<&String> = joints.iter().flatten().collect();
    if let Some(unknown) = contract.unknown_joint(&all.into_iter().cloned().collect::<Vec<String>>()) {
        return Err(BagError::Usage(unknown));
    }
    let (episodes, types) = read_episodes(folder, (&features, &widths), options.episodes.as_deref(), options.most_bytes)?;
    let mut tables = Vec::with_capacity(episodes.len());
    for (episode, rows) in episodes {
        let name = format!("episode_{episode:06}");
        let mut table = Table { columns: vec![Column::new("t", times(&rows, info.fps), NumberType::Double)], ..Table::default() };
        for (place, role) in there.iter().enumerate() {
            for (axis, joint) in joints[place].iter().enumerate() {
                let scale = contract.scale(*role, joint).map_err(BagError::Usage)?;
                let stored = rows.features[place].iter().skip(axis).step_by(widths[place]);
                let mut values: Vec<f64> = stored.map(|value| value * scale).collect();
                if *role == Role::Command && contract.commanded_at == CommandedAt::Next {
                    values.rotate_right(1);
                }
                let of = if scale == 1.0 { types[place] } else { NumberType::Double };
                let called = contract.joints.get(joint).unwrap_or(joint);
                table.columns.push(Column::new(format!("{called}.{}", role.name()), values, of));
            }
        }
        if there.contains(&Role::Command) && contract.commanded_at == CommandedAt::Next {
            // The command sent at the first row is not known.
            table.drop_first_row();
        }
        tables.push((name, table));
    }
    Ok(tables)
}

/// Rows by episode, and what the numbers of each feature are in the files.
fn read_episodes(
    folder: &Path,
    (features, widths): (&[&str], &[usize]),
    wanted: Option<&[u64]>,
    most_bytes: u64,
) -> Result<(BTreeMap<u64, Rows>, Vec<NumberType>), BagError> {
    let wanted: Option<BTreeSet<u64>> = wanted.map(|wanted| wanted.iter().copied().collect());
    let mut episodes: BTreeMap<u64, Rows> = BTreeMap::new();
    let mut types = vec![NumberType::Single; features.len()];
    let memory = Rc::new(Memory::new(most_bytes));
    for path in data_files(folder)? {
        let file = ParquetFile::open(&path, &memory)?;
        let column = |name: &str, width: usize| -> Result<(Vec<f64>, NumberType), BagError> {
            let wrong = |what: String| BagError::File { path: path.clone(), what };
            let place = file.columns().find(|(_, found, _)| *found == name).map(|(place, _, _)| place);
            let place = place.ok_or_else(|| wrong(format!("has no column {name:?}, which meta/info.json lists")))?;
            let (values, found, of) = file.matrix(place)?;
            match found == width || values.is_empty() {
                true => Ok((values, of)),
                false => Err(wrong(format!("column {name:?}: has {found} numbers a row, meta/info.json states {width}"))),
            }
        };
        let (stamps, frames, numbers) = (column("timestamp", 1)?.0, column("frame_index", 1)?.0, column("episode_index", 1)?.0);
        let mut values = Vec::with_capacity(features.len());
        for ((feature, width), of) in features.iter().zip(widths).zip(&mut types) {
            let (found, stored) = column(feature, *width)?;
            if stored != NumberType::Single {
                *of = stored;
            }
            values.push(found);
        }
        let rows = numbers.len();
        if stamps.len() != rows || frames.len() != rows || values.iter().zip(widths).any(|(values, width)| values.len() != rows * width) {
            return Err(BagError::File { path, what: "its columns are of different lengths; it is damaged".to_owned() });
        }
        for (row, number) in numbers.iter().enumerate() {
            let number = match *number {
                whole if whole >= 0.0 && whole.fract() == 0.0 => whole as u64,
                other => {
                    return Err(BagError::File {
                        path,
                        what: format!("row {}: column \"episode_index\": {other} is no number of an episode", row + 1),
                    });
                }
            };
            if wanted.as_ref().is_some_and(|wanted| !wanted.contains(&number)) {
                continue;
            }
            let into = episodes.entry(number).or_insert_with(|| Rows { features: vec![Vec::new(); features.len()], ..Rows::default() });
            into.stamps.push(stamps[row]);
            into.frames.push(frames[row]);
            for ((values, width), into) in values.iter().zip(widths).zip(&mut into.features) {
                into.extend(&values[row * width..(row + 1) * width]);
            }
        }
    }
    let absent: Vec<String> = wanted.iter().flatten().filter(|number| !episodes.contains_key(number)).map(u64::to_string).collect();
    match absent.is_empty() {
        true => Ok((episodes, types)),
        false => Err(BagError::Usage(format!("{}: has no episode {}", folder.display(), absent.join(", ")))),
    }
}

/// `data/chunk-*/file-*.parquet`, in the order of their names.
fn data_files(folder: &Path) -> Result<Vec<PathBuf>, BagError> {
    let data = folder.join("data");
    let listed = |folder: &Path, begins: &str, ends: &str| -> Result<Vec<PathBuf>, BagError> {
        let entries = std::fs::read_dir(folder).map_err(BagError::io(folder))?;
        let is_one = |path: &PathBuf| {
            path.file_name().and_then(|name| name.to_str()).is_some_and(|name| name.starts_with(begins) && name.ends_with(ends))
        };
        let mut found: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_one).collect();
        // file-1000 comes behind file-999.
        found.sort_by_key(|path| (path.as_os_str().len(), path.clone()));
        Ok(found)
    };
    let mut files = Vec::new();
    for chunk in listed(&data, "chunk-", "")? {
        files.extend(listed(&chunk, "file-", ".parquet")?);
    }
    match files.is_empty() {
        true => Err(BagError::File { path: data, what: "holds no chunk-*/file-*.parquet".to_owned() }),
        false => Ok(files),
    }
}

/// The frame's number over the rate where the stamps say the same.
fn times(rows: &Rows, fps: f64) -> Vec<f64> {
    let (Some(first), Some(begin)) = (rows.frames.first(), rows.stamps.first()) else { return Vec::new() };
    let even: Vec<f64> = rows.frames.iter().map(|frame| frame / fps - first / fps + begin).collect();
    let close = |(stamp, even): (&f64, &f64)| (stamp - even).abs() <= 1e-6 + 4.0 * f64::from(f32::EPSILON) * even.abs();
    if rows.stamps.iter().zip(&even).all(close) { even } else { rows.stamps.clone() }
}
