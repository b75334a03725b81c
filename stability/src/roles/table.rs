//! The wanted signals from a table (CSV): columns in the place of topics.

use super::file::{Located, Roles};
use crate::from_bag::{SessionError, SignalRole};
use crate::grid::Series;
use backdrive_plant::recording::{ColumnRule, Columns, Piece, Recording, Source, read_csv, read_headings};
use backdrive_plant::tomlfile::unknown;
use std::path::Path;

/// Columns of a table by name.
pub(super) type Named = Vec<(String, Vec<f64>)>;

/// Whether a recording is a table: by its ending.
pub(super) fn is_table(path: &Path) -> bool {
    path.is_file() && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"))
}

/// Reads every wanted signal, and every other column that holds numbers. Headings may name a unit (`x [mm]`); what is read is in SI units.
pub(super) fn gather(path: &Path, roles: &Roles, wanted: &[(SignalRole, &Located)]) -> Result<(Vec<Series>, Named), SessionError> {
    let headings = read_headings(path)?;
    let bare = |heading: &str| heading.split_once('[').map_or(heading, |(name, _)| name).trim().to_owned();
    let mut columns: Vec<&str> = Vec::new();
    for (_, located) in wanted {
        let Some(column) = &located.column else {
            let what = format!("{} is a topic, but {} is a table: name a column", located.place(), path.display());
            return Err(roles.at(located, format!("{what}; it has {}", headings.join(", "))));
        };
        if !headings.iter().any(|h| h == column || bare(h) == *column) {
            let names: Vec<String> = headings.iter().map(|h| bare(h)).collect();
            let what = unknown("column", column, names.iter().map(String::as_str));
            return Err(roles.at(located, format!("{what}; {} has {}", path.display(), names.join(", "))));
        }
        columns.push(column);
    }
    let rules: Columns = match roles.time.as_str() {
        "t" => Vec::new(),
        time => vec![("t".to_owned(), ColumnRule::of(Source::Column(time.to_owned())))],
    };
    // A column of words is in nobody's way that did not ask for it.
    let read = |only: Option<&[&str]>| read_csv(path, only, &rules, &Piece::default());
    let mut asked = columns.clone();
    asked.sort_unstable();
    asked.dedup();
    let table = read(None).or_else(|_| read(Some(&asked)))?;
    let stamps: Vec<i64> = table.t.iter().map(|t| (t * 1e9).round() as i64).collect();
    let series = wanted.iter().zip(&columns).map(|((_, located), column)| {
        let values = values_of(&table, column).ok_or_else(|| roles.at(located, format!("{column} holds no numbers")))?;
        let values = values.iter().map(|x| located.signal.scale * x + located.signal.offset).collect();
        Ok(Series { stamps: stamps.clone(), logged: stamps.clone(), values, stamped: true })
    });
    Ok((series.collect::<Result<Vec<_>, SessionError>>()?, table.signals))
}

/// A column by its heading, with or without its unit.
fn values_of<'a>(table: &'a Recording, column: &str) -> Option<&'a [f64]> {
    let bare = column.split_once('[').map_or(column, |(name, _)| name).trim();
    table.signal(column).or_else(|| table.signal(bare)).or_else(|| {
        let of = |name: &str| name.split_once('[').is_some_and(|(name, _)| name.trim() == column);
        table.signals.iter().find(|(name, _)| of(name)).map(|(_, values)| values.as_slice())
    })
}
