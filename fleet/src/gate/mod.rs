//! Two sets of recordings beside each other: what changed, whether it matters by stated bounds, and what it does to the stability limit.

mod bounds;
mod compare;
mod graphs;
mod junit;
mod loops;
mod types;

pub use bounds::Bounds;
pub use junit::junit;
pub use types::{Check, Gated, Kind, Outcome};

use crate::answer::answer;
use crate::error::FleetError;
use crate::manifest::{Entry, Manifest, Source};
use crate::table::Table;
use crate::what::What;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Compares two sets of recordings: folders, manifests or single recordings.
///
/// # Errors
/// A set or a model cannot be read, or the two have nothing in common that can be compared.
pub fn gate(old: &Path, new: &Path, model: Option<&Path>, roles: Option<&Path>, bounds: &Bounds) -> Result<Gated, FleetError> {
    let mut notes = Vec::new();
    let [old, new] = [side(old, model, roles, &mut notes)?, side(new, model, roles, &mut notes)?];
    let mut checks = compare::joints(&old.joints, &new.joints, bounds);
    let [before, after] = [&old, &new].map(|side| loops::Loops { table: &side.loops, bags: &side.bags });
    checks.extend(loops::loops(&before, &after, bounds, &mut notes));
    if checks.is_empty() {
        let why = notes.first().map_or(String::new(), |note| format!("; {note}"));
        return Err(FleetError::input(format!("the two sets have no joint and no loop in common, so nothing can be compared{why}")));
    }
    checks.sort_by_key(|check| match check.outcome {
        Outcome::Failed => 0,
        Outcome::Uncertain => 1,
        Outcome::NotJudged => 2,
        Outcome::Passed => 3,
    });
    Ok(Gated { checks, notes })
}

/// One of the two sets.
struct Side {
    joints: Table,
    loops: Table,
    /// The bags of the loops by the names of their recordings.
    bags: BTreeMap<String, PathBuf>,
}

fn side(path: &Path, model: Option<&Path>, roles: Option<&Path>, notes: &mut Vec<String>) -> Result<Side, FleetError> {
    let mut manifest = opened(path, model)?;
    manifest.roles = roles.map(Path::to_path_buf).or(manifest.roles);
    let mut side = Side { joints: Table::new(What::Triage), loops: Table::new(What::Stability), bags: BTreeMap::new() };
    for entry in &manifest.entries {
        let loaded = entry.load()?;
        let is_bag = matches!(&entry.source, Source::File(path) if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap")));
        let of_loop = if is_bag || manifest.roles.is_some() { Some(answer(&manifest, entry, &loaded, What::Stability)?) } else { None };
        if let Some(found) = of_loop.filter(|found| found.error.is_none()) {
            side.loops.add(entry, "", &found);
            if let (Source::File(path), None) = (&entry.source, &manifest.roles) {
                side.bags.insert(entry.name.clone(), path.clone());
            }
            continue;
        }
        let found = answer(&manifest, entry, &loaded, What::Triage)?;
        match &found.error {
            Some(why) => notes.push(format!("{}: {why}", entry.name)),
            None => side.joints.add(entry, "", &found),
        }
    }
    if side.joints.rows.is_empty() && side.loops.rows.is_empty() {
        let why = notes.first().cloned().unwrap_or_default();
        return Err(FleetError::input(format!("{}: no recording of it gave an answer; {why}", path.display())));
    }
    Ok(side)
}

/// A manifest, a folder, or one recording.
fn opened(path: &Path, model: Option<&Path>) -> Result<Manifest, FleetError> {
    if !path.exists() {
        return Err(FleetError::input(format!("{}: there is no such file or folder", path.display())));
    }
    if path.is_dir() || path.extension().is_some_and(|e| e == "toml") {
        return Manifest::open(path, model);
    }
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let entry = Entry {
        name,
        source: Source::File(path.to_path_buf()),
        unit: "device".to_string(),
        date: None,
        temperature: None,
        since_start: None,
        model: model.map(Path::to_path_buf),
    };
    Ok(Manifest { name: path.display().to_string(), settings: String::new(), roles: None, entries: vec![entry] })
}
