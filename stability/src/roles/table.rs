//! The wanted signals from a table (CSV): columns instead of topics.

use super::file::{Located, Roles};
use crate::grid::Series;
use crate::signal_role::{SessionError, SignalRole};
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
    // A column of words disturbs no reader that did not request it.
    let read = |only: Option<&[&str]>| read_csv(path, only, &rules, &Piece::default());
    let mut asked = columns.clone();
    asked.sort_unstable();
    asked.dedup();
    let table = read(None).or_else(|_| read(Some(&asked)))?;
    let stamps: Vec<i64> = table.t.iter().map(|t| (t * 1e9).round() as i64).collect();
    let series = wanted.iter().zip(&columns).map(|((_, located), column)| {
        let values = values_of(&table, column).ok_or_else(|| roles.at(located, format!("{column} contains no numbers")))?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::Session;

    const ROLES: &str = "time = \"time\"\n[signals]\nx_m = \"xm\"\nx_s = { column = \"xs [mm]\", scale = 2.0 }\nF_f = \"fm\"\ntau_s = \"fs\"\n\
                         F_s = \"contact\"\n[sensors]\nsecond = { column = \"gauge\", of = \"F_s\" }\n";

    fn table(dir: &Path) -> std::path::PathBuf {
        let mut text = "time [ms],xm,xs [mm],fm,fs,contact,gauge,unused,words\n".to_string();
        for row in 0..4000 {
            let t = f64::from(row) * 1e-3;
            let x = 0.05 * (5.0 * t).sin();
            text += &format!("{},{x},{},{},{},{},9.99,3,on\n", 1e3 * t, 500.0 * x, -x, x, -0.1 * (3.0 * t).sin());
        }
        let path = dir.join("session.csv");
        std::fs::write(&path, text).unwrap();
        path
    }

    #[test]
    fn a_table_becomes_a_session_in_si_units_and_its_dead_columns_are_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = table(dir.path());
        let roles = Roles::from_toml(ROLES, "roles.toml").unwrap();
        let session = Session::from_roles(&path, &roles).unwrap();
        let axis = &session.axes[0];
        let turning = Roles::from_toml(&format!("motion = \"rotation\"\n{ROLES}"), "roles.toml").unwrap();
        let turning = Session::from_roles(&path, &turning).unwrap();
        assert_eq!((axis.unit.text(0.05), turning.axes[0].unit.text(0.05)), ("0.0500 (m or rad)".to_string(), "0.050 rad".to_string()));
        assert!((session.period_s - 1e-3).abs() < 1e-12 && session.len() == 4000);
        assert!((axis.slave.as_ref().unwrap()[1000] - axis.master[1000]).abs() < 1e-9, "millimetres, and a scale of 2");
        assert_eq!(axis.command, axis.master);
        let told: Vec<&str> = session.sensors.iter().map(|s| s.signal.as_str()).collect();
        assert_eq!(told, ["second (gauge)"], "a column of words keeps the others from being read: {told:?}");
        // Without it every column is read.
        let text = std::fs::read_to_string(&path).unwrap().replace(",words", "").replace(",on\n", "\n");
        std::fs::write(&path, text).unwrap();
        let session = Session::from_roles(&path, &roles).unwrap();
        let told: Vec<&str> = session.sensors.iter().map(|s| s.signal.as_str()).collect();
        assert_eq!(told, ["second (gauge)", "unused"]);
    }

    #[test]
    fn what_does_not_go_with_a_table_is_told_at_its_line() {
        let dir = tempfile::tempdir().unwrap();
        let path = table(dir.path());
        let says = |from: &str, to: &str, what: &[&str]| {
            let error =
                Session::from_roles(&path, &Roles::from_toml(&ROLES.replace(from, to), "roles.toml").unwrap()).unwrap_err().to_string();
            assert!(what.iter().all(|w| error.contains(w)), "{error}");
        };
        says("\"fm\"", "\"fn\"", &["roles.toml:5", "F_f", "unknown column", "contact"]);
        says("\"fm\"", "\"/motor.effort[0]\"", &["roles.toml:5", "/motor.effort[0] is a topic", "name a column"]);
        says("\"time\"", "\"clock\"", &["session.csv", "clock"]);
        says("\"fm\"", "\"words\"", &["session.csv:2", "words", "on"]);
    }
}
