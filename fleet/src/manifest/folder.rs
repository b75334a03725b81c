//! A folder as a manifest: its folders are the units, and dates stand in the names of the files.

use super::types::{Entry, Manifest, Source};
use crate::date::Date;
use crate::error::FleetError;
use backdrive_bags::is_lerobot;
use std::path::{Path, PathBuf};

/// Folders below one another, at most: a link to a folder above would have no end.
const DEEPEST: usize = 8;

/// Opens a dataset, or a folder of recordings.
pub(super) fn open(folder: &Path) -> Result<Manifest, FleetError> {
    Ok(Manifest { name: folder.display().to_string(), settings: String::new(), roles: None, entries: entries(folder, "")? })
}

/// All recordings below a folder, with names that begin with `prefix`.
pub(super) fn entries(folder: &Path, prefix: &str) -> Result<Vec<Entry>, FleetError> {
    if is_lerobot(folder) {
        return episodes(folder, prefix);
    }
    let mut files = Vec::new();
    below(folder, 0, &mut files)?;
    let entry = |path: PathBuf| {
        let inside = path.strip_prefix(folder).unwrap_or(&path).to_path_buf();
        let mut parts: Vec<String> = inside.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
        let name = parts.join("/");
        let file = parts.pop().unwrap_or_default();
        let date = Date::in_name(&file).or_else(|| parts.iter().rev().find_map(|part| Date::in_name(part))).or_else(|| date_in_bag(&path));
        let own = || folder.file_name().map_or_else(|| "unit".to_string(), |name| name.to_string_lossy().into_owned());
        Entry {
            name: format!("{prefix}{name}"),
            source: Source::File(path),
            unit: parts.into_iter().next().unwrap_or_else(own),
            date,
            temperature: None,
            since_start: None,
            model: None,
        }
    };
    Ok(files.into_iter().map(entry).collect())
}

fn below(folder: &Path, depth: usize, files: &mut Vec<PathBuf>) -> Result<(), FleetError> {
    let failed = |e: std::io::Error| FleetError::file(folder, format!("cannot be read: {e}"));
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if path.is_dir() && depth < DEEPEST && !hidden {
            below(&path, depth + 1, files)?;
        } else if path.is_file() && is_recording(&path) && !hidden {
            files.push(path);
        }
    }
    Ok(())
}

/// The episodes of a LeRobot dataset; the dataset is one unit, and an episode has no date.
fn episodes(folder: &Path, prefix: &str) -> Result<Vec<Entry>, FleetError> {
    let info = folder.join("meta/info.json");
    let text = std::fs::read_to_string(&info).map_err(|e| FleetError::file(&info, format!("cannot be read: {e}")))?;
    let value: serde_json::Value = serde_json::from_str(&text).map_err(|e| FleetError::input(format!("{}: {e}", info.display())))?;
    let count = value["total_episodes"].as_u64().ok_or_else(|| {
        FleetError::input(format!("{}: total_episodes is no number; it is not the file of a dataset of version 3", info.display()))
    })?;
    let robot = value["robot_type"].as_str().map(str::to_string);
    let unit = robot.or_else(|| folder.file_name().map(|n| n.to_string_lossy().into_owned())).unwrap_or_default();
    let entry = |episode| Entry {
        name: format!("{prefix}episode_{episode:06}"),
        source: Source::Episode(folder.to_path_buf(), episode),
        unit: unit.clone(),
        date: None,
        temperature: None,
        since_start: None,
        model: None,
    };
    Ok((0..count).map(entry).collect())
}

/// Whether a file is a recording by its ending.
fn is_recording(path: &Path) -> bool {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    ["csv", "mcap", "parquet", "mat", "npz"].contains(&ending.as_str())
}

/// The first message's time of a bag, where it is one of the calendar: bags of simulations begin at 0.
pub(super) fn date_in_bag(path: &Path) -> Option<Date> {
    let is_bag = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap"));
    let start = if is_bag { backdrive_bags::info(path).ok()?.start_s? } else { return None };
    (start > 946_684_800.0).then_some(Date(start as i64)) // 2000-01-01
}
