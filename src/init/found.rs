//! The recordings that are there, and what their columns may be.

use crate::failure::Failure;
use backdrive_bags::{Reader, columns_of};
use backdrive_plant::recording::units::{self, Kind, Unit};
use backdrive_plant::recording::{Source, read_headings};
use backdrive_plant::set::recordings_in;
use backdrive_plant::tomlfile::unknown;
use std::path::{Path, PathBuf};

/// A column of a table, or a field of a bag's topic.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// As it is shown and asked for: a heading, or TOPIC.FIELD.
    pub name: String,
    /// Where it stands.
    pub source: Source,
    /// The unit that its heading names.
    pub unit: Option<Unit>,
}

impl Column {
    fn of_heading(heading: String) -> Column {
        // A unit that is not known is asked for.
        let unit = units::split(&heading).1.and_then(|unit| units::parse(unit).ok());
        Column { source: Source::Column(heading.clone()), name: heading, unit }
    }

    fn of_topic(topic: String, field: String) -> Column {
        Column { name: format!("{topic}.{field}"), source: Source::Topic { topic, field }, unit: None }
    }

    /// Its name without a unit and without what stands before it in a bag: what a person calls it.
    pub fn short_name(&self) -> &str {
        match &self.source {
            Source::Column(heading) => units::split(heading).0,
            // A table that was made a bag keeps the names of its columns.
            Source::Topic { topic, field } => {
                topic.strip_prefix("/recording/").unwrap_or_else(|| field.split(['[', '.']).next().unwrap_or(field))
            }
        }
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
}

/// Looks at the headings of the recordings that were named, or at those of all in the folder.
///
/// # Errors
/// When there are none, one cannot be read, or tables and bags are mixed.
pub fn recordings(folder: &Path, named: &[PathBuf]) -> Result<Recordings, Failure> {
    let shown = folder.display();
    if !folder.is_dir() {
        return Err(Failure::input(format!("{shown}: there is no such folder; make it and put the recordings there, or name another")));
    }
    let paths: Vec<PathBuf> = match named {
        [] => recordings_in(folder)?.iter().map(|name| folder.join(name)).collect(),
        named => named.iter().map(|path| if path.exists() { path.clone() } else { folder.join(path) }).collect(),
    };
    if paths.is_empty() {
        return Err(Failure::input(format!("{shown}: has no recordings (.csv or .mcap); name them with --recording")));
    }
    let is_bag = |path: &PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap"));
    if paths.iter().any(is_bag) && !paths.iter().all(is_bag) {
        return Err(Failure::input(format!(
            "{shown}: holds tables and bags, whose columns are named differently; name those of one kind with --recording, or make bags of the \
             tables with `backdrive bag import`"
        )));
    }
    let mut all: Vec<Vec<Column>> = Vec::new();
    for path in &paths {
        all.push(match is_bag(path) {
            true => {
                let reader = Reader::open(path).map_err(Failure::input)?;
                columns_of(&reader, None).map_err(Failure::input)?.into_iter().map(|s| Column::of_topic(s.topic, s.field)).collect()
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
    if columns.is_empty() {
        return Err(Failure::input(format!(
            "{shown}: the recordings have no column in common; name those that belong together with --recording"
        )));
    }
    let names = paths.iter().map(|path| name_in(folder, path)).collect();
    Ok(Recordings { paths, names, columns, partial })
}

/// A path as it is called from a folder; a whole one where it lies elsewhere.
fn name_in(folder: &Path, path: &Path) -> String {
    let whole = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let path = whole(path);
    path.strip_prefix(whole(folder)).unwrap_or(&path).display().to_string()
}

impl Recordings {
    /// The column that is meant: by its heading, or by its name where that is one column's only.
    ///
    /// # Errors
    /// A sentence that says what there is.
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
        Recordings { paths: Vec::new(), names: Vec::new(), columns, partial: vec!["only_here".to_string()] }
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
