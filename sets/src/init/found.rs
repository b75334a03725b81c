//! The recordings that are there, and what their columns may be.

use super::error::InitError;
use super::made::{self, Made};
use super::options::Options;
use backdrive_bags::{Reader, Signal, columns_of};
use backdrive_plant::recording::units::{self, Kind, Unit};
use backdrive_plant::recording::{Source, read_headings};
use backdrive_plant::tomlfile::unknown;
use std::path::{Path, PathBuf};

/// A column of a table, or a field of a bag's topic.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// The name by which it is shown and asked for: a heading, or TOPIC.FIELD.
    pub name: String,
    /// Where it stands.
    pub source: Source,
    /// What a person calls it: its name without a unit and without what stands before it in a bag.
    short: String,
    /// The unit that its heading names, or named in the table that a bag was made of.
    pub unit: Option<Unit>,
    /// The unit that its heading states, where that is not known.
    pub unknown_unit: Option<String>,
    /// Whether its type states that its values are in SI units.
    pub is_si: bool,
}

impl Column {
    fn of_heading(heading: String) -> Column {
        let (short, stated) = units::split(&heading);
        let (short, unit) = (short.to_string(), stated.and_then(|unit| units::parse(unit).ok()));
        // A unit that is not known is asked for.
        let unknown_unit = stated.filter(|_| unit.is_none()).map(str::to_string);
        Column { source: Source::Column(heading.clone()), short, name: heading, unit, unknown_unit, is_si: false }
    }

    fn of_topic(reader: &Reader, signal: Signal) -> Column {
        let Signal { name: title, topic, field, .. } = signal;
        let name = format!("{topic}.{field}");
        let unit = reader.header().and_then(|header| header.column_units.get(&name)).and_then(|unit| units::parse(unit).ok());
        // A table that was made a bag keeps the names of its columns.
        let short = match topic.starts_with("/recording/") && !title.starts_with(&topic) {
            true => title,
            false => field.split(['[', '.']).next().unwrap_or(&field).to_string(),
        };
        let is_joint_state = reader.topic(&topic).is_ok_and(|topic| topic.type_name.ends_with("JointState"));
        let is_si = is_joint_state && !topic.starts_with("/recording/");
        Column { name, source: Source::Topic { topic, field }, short, unit, unknown_unit: None, is_si }
    }

    /// Its name without a unit and without what stands before it in a bag: what a person calls it.
    pub fn short_name(&self) -> &str {
        &self.short
    }
}

/// Recordings that belong together.
pub struct Recordings {
    /// Where they lie.
    pub paths: Vec<PathBuf>,
    /// Their names as a set in the folder calls them.
    pub names: Vec<String>,
    /// What all of them hold.
    pub columns: Vec<Column>,
    /// What only some of them hold, by name.
    pub partial: Vec<String>,
    /// Topics whose messages are not read: a sentence each.
    pub unread: Vec<String>,
    /// Bags that were made of tables of other kinds.
    pub made: Option<Made>,
}

/// Looks at the headings of the recordings that were named, or at those of all in the folder.
///
/// # Errors
/// When there are none, one cannot be read, or tables and bags are mixed.
pub fn recordings(options: &Options) -> Result<Recordings, InitError> {
    let (folder, named) = (options.folder.as_path(), options.recording.as_slice());
    let shown = folder.display();
    if !folder.is_dir() {
        return Err(InitError::input(format!("{shown}: there is no such folder; make it and put the recordings there, or name another")));
    }
    let paths: Vec<PathBuf> = match named {
        [] => made::recordings_in(folder)?,
        named => named.iter().map(|path| if path.exists() { path.clone() } else { folder.join(path) }).collect(),
    };
    if paths.is_empty() {
        return Err(InitError::input(format!(
            "{shown}: has no recordings (.csv, .mcap, .npz, .mat or .parquet); name them with --recording"
        )));
    }
    let made = made::make(options, &paths)?;
    let paths = made.as_ref().map_or(paths, Made::paths);
    let is_bag = |path: &PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap"));
    if paths.iter().any(is_bag) && !paths.iter().all(is_bag) {
        return Err(InitError::input(format!(
            "{shown}: contains tables and bags, whose columns are named differently; name those of one kind with --recording, or make \
             bags of the tables with `backdrive bag import`"
        )));
    }
    let (mut all, mut unread): (Vec<Vec<Column>>, Vec<String>) = Default::default();
    for path in &paths {
        all.push(match is_bag(path) {
            true => {
                let reader = Reader::open_begun(path).map_err(InitError::input)?;
                unread.extend(reader.topics().iter().filter_map(|topic| topic.unread()));
                columns_of(&reader, None).map_err(InitError::input)?.into_iter().map(|signal| Column::of_topic(&reader, signal)).collect()
            }
            false => read_headings(path)?.into_iter().filter(|h| !h.is_empty()).map(Column::of_heading).collect(),
        });
    }
    let (mut columns, mut partial) = (Vec::new(), Vec::new());
    for column in all.iter().flatten() {
        if columns.contains(column) || partial.contains(&column.name) {
            continue;
        }
        match all.iter().all(|of_file| of_file.contains(column)) {
            true => columns.push(column.clone()),
            false => partial.push(column.name.clone()),
        }
    }
    if let (true, true, Some(unread)) = (columns.is_empty(), partial.is_empty(), unread.first()) {
        return Err(InitError::input(format!("{shown}: the recordings have no readable numeric columns: {unread}")));
    }
    if columns.is_empty() {
        return Err(InitError::input(format!(
            "{shown}: the recordings have no column in common; name those that belong together with --recording"
        )));
    }
    let names = made.as_ref().map_or_else(|| paths.iter().map(|path| name_in(folder, path)).collect(), Made::names);
    unread.dedup();
    Ok(Recordings { paths, names, columns, partial, unread, made })
}

/// A path relative to a folder; the whole path where it lies outside.
fn name_in(folder: &Path, path: &Path) -> String {
    let whole = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let path = whole(path);
    path.strip_prefix(whole(folder)).unwrap_or(&path).display().to_string()
}

impl Recordings {
    /// The column that is meant: by its heading, or by its name where that is one column's only.
    ///
    /// # Errors
    /// A sentence that lists what there is.
    pub fn column(&self, text: &str) -> Result<Column, String> {
        let by = |is: &dyn Fn(&Column) -> bool| -> Vec<&Column> { self.columns.iter().filter(|c| is(c)).collect() };
        let whole = by(&|c| c.name == text);
        let found = if whole.is_empty() { by(&|c| c.short_name() == text) } else { whole };
        match found.as_slice() {
            [one] => Ok((*one).clone()),
            [] if self.partial.iter().any(|name| name == text) => Err("is not in all of the recordings".to_string()),
            [] => Err(unknown("column", text, self.columns.iter().map(|c| c.name.as_str()))),
            several => {
                let names: Vec<&str> = several.iter().map(|c| c.name.as_str()).collect();
                Err(format!("is the name of several columns: {}", names.join(", ")))
            }
        }
    }

    /// The column that is likely to be of these kinds: by its unit, else by the words in its name. `None` where no or more than one is.
    pub fn guess(&self, kinds: &[Kind], words: &[&str], taken: &[&Column]) -> Option<&Column> {
        let free = || self.columns.iter().filter(|c| !taken.contains(c));
        let only = |found: Vec<&'_ Column>| -> Option<usize> {
            match found.as_slice() {
                [one] => self.columns.iter().position(|c| c == *one),
                _ => None,
            }
        };
        let of_unit: Vec<&Column> = free().filter(|c| c.unit.is_some_and(|u| kinds.contains(&u.kind))).collect();
        let named = |c: &Column| {
            let name = c.short_name().to_lowercase();
            name.split(|c: char| !c.is_ascii_alphabetic()).any(|part| words.contains(&part))
        };
        let of_word: Vec<&Column> = free().filter(|c| c.unit.is_none() && named(c)).collect();
        let found = if of_unit.is_empty() { of_word } else { of_unit };
        only(found).and_then(|index| self.columns.get(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(headings: &[&str]) -> Recordings {
        let columns = headings.iter().map(|h| Column::of_heading((*h).to_string())).collect();
        Recordings { paths: Vec::new(), names: Vec::new(), columns, partial: vec!["only_here".to_string()], unread: Vec::new(), made: None }
    }

    #[test]
    fn a_column_is_meant_by_its_heading_or_its_name() {
        let found = of(&["t [ms]", "i [A]", "x [mm]", "x [counts]"]);
        assert_eq!(found.column("i").unwrap().name, "i [A]");
        assert_eq!(found.column("x [mm]").unwrap().unit.unwrap().name, "mm");
        assert_eq!(found.column("x").unwrap_err(), "is the name of several columns: x [mm], x [counts]");
        assert!(found.column("only_here").unwrap_err().contains("not in all"));
        assert!(found.column("j").unwrap_err().contains("i [A]"));
    }

    #[test]
    fn a_guess_is_by_unit_then_by_word_and_never_one_of_two() {
        let found = of(&["time", "motor_current", "angle [deg]", "speed", "v_2"]);
        let guess = |kinds: &[Kind], words: &[&str]| found.guess(kinds, words, &[]).map(|c| c.name.as_str());
        assert_eq!(guess(&[Kind::Current], &["current"]), Some("motor_current"));
        assert_eq!(guess(&[Kind::Angle], &["position"]), Some("angle [deg]"));
        assert_eq!(guess(&[Kind::Speed], &["speed", "v"]), None);
        assert_eq!(found.guess(&[Kind::Angle], &[], &[&found.columns[2]]), None);
    }
}
