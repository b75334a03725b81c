//! A manifest as a TOML file.

use super::address::local;
use super::folder::{self, date_in_bag};
use super::types::{Entry, Manifest, Source};
use crate::date::Date;
use crate::error::FleetError;
use backdrive_plant::elements::Range;
use backdrive_plant::tomlfile::{Table, read_text};
use std::path::{Path, PathBuf};

/// Keys of a `set.toml` that hold for every recording.
const OF_SETS: [&str; 6] = ["columns", "joints", "initial", "ignore", "unknown", "mixed_rates"];

/// Opens it; files are relative to its folder.
pub(super) fn open(path: &Path) -> Result<Manifest, FleetError> {
    if !path.exists() {
        return Err(FleetError::input(format!("{}: there is no such file or folder", path.display())));
    }
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let mut top = Table::open(path).map_err(FleetError::input)?;
    let model = top.string("model").map_err(FleetError::input)?.map(|model| folder.join(model));
    let roles = top.string("roles").map_err(FleetError::input)?.map(|roles| folder.join(roles));
    let mut entries = Vec::new();
    for mut table in top.tables("recordings").map_err(FleetError::input)? {
        entries.push(recording(&mut table, &folder)?);
        table.finish().map_err(FleetError::input)?;
    }
    for mut table in top.tables("folders").map_err(FleetError::input)? {
        let below = table.need_string("path").map_err(FleetError::input)?;
        let unit = table.string("unit").map_err(FleetError::input)?;
        let own = table.string("model").map_err(FleetError::input)?.map(|model| folder.join(model));
        let place = folder.join(local(Path::new(&below))?);
        if !place.is_dir() {
            return Err(FleetError::input(table.error_at("path", format!("there is no folder {}", place.display()))));
        }
        table.finish().map_err(FleetError::input)?;
        let prefix = if below == "." { String::new() } else { format!("{}/", below.trim_end_matches('/')) };
        for mut entry in folder::entries(&place, &prefix)? {
            entry.unit = unit.clone().unwrap_or(entry.unit);
            entry.model = own.clone();
            entries.push(entry);
        }
    }
    for key in OF_SETS {
        top.skip(key);
    }
    top.finish().map_err(FleetError::input)?;
    for entry in &mut entries {
        entry.model = entry.model.take().or_else(|| model.clone());
    }
    Ok(Manifest { name: path.display().to_string(), settings: settings(path)?, roles, entries })
}

/// The keys of a set as TOML of their own.
fn settings(path: &Path) -> Result<String, FleetError> {
    let text = read_text(path).map_err(FleetError::input)?;
    let mut document: toml_edit::DocumentMut = text.parse().map_err(|e| FleetError::input(format!("{}: {e}", path.display())))?;
    document.retain(|key, _| OF_SETS.contains(&key));
    Ok(document.to_string())
}

fn recording(table: &mut Table, folder: &Path) -> Result<Entry, FleetError> {
    let file = table.need_string("file").map_err(FleetError::input)?;
    let path: PathBuf = folder.join(local(Path::new(&file))?);
    let name = table.string("name").map_err(FleetError::input)?.unwrap_or_else(|| file.clone());
    let stated = table.string("date").map_err(FleetError::input)?;
    let date = match &stated {
        Some(text) => Some(Date::parse(text).ok_or_else(|| {
            FleetError::input(table.error_at("date", format!("{text:?} is no date; write \"2026-11-03\" or \"2026-11-03T14:05:30Z\"")))
        })?),
        None => Date::in_name(&file).or_else(|| date_in_bag(&path)),
    };
    let entry = Entry {
        unit: table.need_string("unit").map_err(FleetError::input)?,
        temperature: table.number("temperature", Range::Any).map_err(FleetError::input)?,
        since_start: table.number("since_start", Range::Any).map_err(FleetError::input)?,
        model: table.string("model").map_err(FleetError::input)?.map(|model| folder.join(model)),
        source: Source::File(path),
        name,
        date,
    };
    Ok(entry)
}
