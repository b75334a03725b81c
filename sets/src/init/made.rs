//! Bags of tables that a set cannot name as they are: without a heading, without times, or in another format than CSV.

use super::error::InitError;
use super::options::Options;
use backdrive_bags::{ImportOptions, Reader, TableFormat, import_table};
use backdrive_plant::set;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Folder of these bags, in that of the set.
const BAGS: &str = "bags";

/// Names of a column of times, in this order, where nobody states it.
const TIMES: [&str; 3] = ["t", "time", "timestamp"];

/// Bags that were made, beside their places until all else is known.
pub struct Made {
    beside: TempDir,
    folder: PathBuf,
    /// File names.
    names: Vec<String>,
}

/// The recordings of a folder: CSV and bags; where there are none, tables in other formats.
///
/// # Errors
/// It cannot be read.
pub fn recordings_in(folder: &Path) -> Result<Vec<PathBuf>, InitError> {
    let found = set::recordings_in(folder)?;
    if !found.is_empty() {
        return Ok(found.iter().map(|name| folder.join(name)).collect());
    }
    let failed = |e: std::io::Error| InitError::input(format!("{}: cannot be read: {e}", folder.display()));
    let mut others = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.is_file() && TableFormat::of_ending(&path).is_some() {
            others.push(path);
        }
    }
    others.sort();
    Ok(others)
}

/// Makes bags of the tables, where they need it; `None` where they are recordings as they are.
///
/// # Errors
/// A table cannot be read, or a bag that is not of the same table lies at its place.
pub fn make(options: &Options, paths: &[PathBuf]) -> Result<Option<Made>, InitError> {
    let is_bag = |path: &Path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap"));
    let is_asked = !options.columns.is_empty() || options.rate.is_some();
    let is_other = |path: &PathBuf| !is_bag(path) && TableFormat::of_ending(path).is_some_and(|format| format != TableFormat::Csv);
    if !is_asked && !paths.iter().any(is_other) {
        return Ok(None);
    }
    if let Some(bag) = paths.iter().find(|path| is_bag(path)) {
        let what = if is_asked { "--columns and --rate are for tables, and it is a bag" } else { "is a bag among tables of other formats" };
        return Err(InitError::input(format!("{}: {what}; name the tables with --recording", bag.display())));
    }
    if let (Some(rate), Some(time)) = (options.rate, &options.time) {
        let message = format!("--rate {rate} is for tables in which no column is the time, and --time names {time:?}; keep one");
        return Err(InitError::Usage(message));
    }
    let folder = options.folder.join(BAGS);
    let failed = |e: std::io::Error| InitError::write(&options.folder, e);
    let beside = tempfile::Builder::new().prefix(".backdrive-").tempdir_in(&options.folder).map_err(failed)?;
    let mut names: Vec<String> = Vec::new();
    for path in paths {
        let name = format!("{}.mcap", path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned()));
        if names.contains(&name) {
            return Err(InitError::input(format!("{}: another table has this name too; rename one", path.display())));
        }
        let place = folder.join(&name);
        if place.exists() && !options.overwrite && !is_of(&place, path) {
            let what = "exists already and was not made from this table; --overwrite replaces it";
            return Err(InitError::input(format!("{}: {what} ({})", place.display(), path.display())));
        }
        import(options, path, &beside.path().join(&name))?;
        names.push(name);
    }
    Ok(Some(Made { beside, folder, names }))
}

/// Whether a bag was made of a table of this name.
fn is_of(bag: &Path, table: &Path) -> bool {
    let title = table.file_name().map(|name| format!("imported from {}", name.to_string_lossy()));
    Reader::open(bag).is_ok_and(|reader| reader.header().is_some_and(|header| Some(&header.title) == title.as_ref()))
}

fn import(options: &Options, path: &Path, bag: &Path) -> Result<(), InitError> {
    let headings = (!options.columns.is_empty()).then(|| options.columns.iter().map(|name| name.trim().to_string()).collect());
    let import = ImportOptions { headings, rate_hz: options.rate, overwrite: true, ..ImportOptions::default() };
    let unit = options.time_unit.as_ref().map_or_else(String::new, |unit| format!(" [{unit}]"));
    let times = match &options.time {
        Some(time) => vec![time.as_str()],
        None if options.rate.is_some() => vec![TIMES[0]],
        None => TIMES.to_vec(),
    };
    let mut first = None;
    for time in times {
        match import_table(path, bag, &ImportOptions { time: format!("{time}{unit}"), ..import.clone() }) {
            Ok(_) => return Ok(()),
            Err(error) => first = first.or(Some(error)),
        }
    }
    first.map_or(Ok(()), |error| Err(InitError::Bag(error)))
}

impl Made {
    /// Where they lie now.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.names.iter().map(|name| self.beside.path().join(name)).collect()
    }

    /// As a set calls them.
    pub fn names(&self) -> Vec<String> {
        self.names.iter().map(|name| format!("{BAGS}/{name}")).collect()
    }

    /// Puts them in their places.
    ///
    /// # Errors
    /// The operating system refuses it.
    pub fn keep(&self) -> Result<(), InitError> {
        std::fs::create_dir_all(&self.folder).map_err(|e| InitError::write(&self.folder, e))?;
        for name in &self.names {
            let place = self.folder.join(name);
            std::fs::rename(self.beside.path().join(name), &place).map_err(|e| InitError::write(&place, e))?;
        }
        Ok(())
    }
}
