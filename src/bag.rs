//! `backdrive bag ...`

use crate::cli;
use crate::failure::{Failure, code};
use crate::output;
use crate::progress::busy;
use backdrive_bags::{
    ColumnMap, DiffOptions, ImportOptions, Quantity, Reader, check, check_target, diff, export_csv, import_csv, info, merge, recover,
};
use std::path::Path;

/// Does what `backdrive bag` is asked.
pub fn bag(command: &cli::Bag) -> Result<u8, Failure> {
    match command {
        cli::Bag::Info { bag, json, check } => show(bag, *json, *check),
        cli::Bag::Import { csv, bag, overwrite, map } => import(csv, bag, *overwrite, map),
        cli::Bag::Export { bag, csv, overwrite, topic } => export(bag, csv, *overwrite, topic),
        cli::Bag::Recover { damaged, bag, overwrite } => save(damaged, bag, *overwrite),
        cli::Bag::Merge { a, b, bag, overwrite, offset, json } => join([a, b], bag, *overwrite, *offset, *json),
        cli::Bag::Play { bag, speed } => crate::play::play(bag, *speed),
        cli::Bag::Diff { a, b, tolerance, ignore, json } => compare(a, b, tolerance, ignore, *json),
    }
}

fn show(bag: &Path, json: bool, whole: bool) -> Result<u8, Failure> {
    let look = if whole { check } else { info };
    let info = busy(&format!("reading {}", bag.display()), || look(bag)).map_err(Failure::input)?;
    if json {
        output::json(&info)?;
    } else {
        output::text(format_args!("{info}"))?;
    }
    let lossy = info.damage.is_some() || !info.ended_cleanly;
    Ok(if lossy { code::LOST_DATA } else { 0 })
}

fn import(csv: &[std::path::PathBuf], bag: &Path, overwrite: bool, maps: &[String]) -> Result<u8, Failure> {
    let columns = maps.iter().map(|map| column_map(map)).collect::<Result<Vec<_>, _>>()?;
    // One table is one experiment and one bag: several go into a folder.
    let into = |table: &Path| -> std::path::PathBuf {
        match csv.len() {
            1 => bag.to_path_buf(),
            _ => bag.join(table.with_extension("mcap").file_name().unwrap_or_default()),
        }
    };
    if csv.len() > 1 {
        std::fs::create_dir_all(bag).map_err(|e| Failure::write(bag, e))?;
    }
    for table in csv {
        check_target(&into(table), overwrite).map_err(Failure::bag)?;
    }
    for table in csv {
        let options = ImportOptions { columns: columns.clone(), overwrite, ..ImportOptions::default() };
        let importing = format!("importing {}", table.display());
        let report = busy(&importing, || import_csv(table, &into(table), &options)).map_err(Failure::bag)?;
        for column in &report.skipped {
            output::note(format_args!(
                "warning: {}: column \"{column}\" holds something that is no number and was left out",
                table.display()
            ));
        }
        for remark in &report.clock {
            output::note(format_args!("warning: {}: {remark}", table.display()));
        }
        output::line(format_args!(
            "{}: {} rows, {} topics -> {}",
            table.display(),
            report.rows,
            report.topics.len(),
            into(table).display()
        ))?;
    }
    Ok(0)
}

/// A table that is there already is replaced only where that was asked for.
pub fn may_replace(table: &Path, overwrite: bool) -> Result<(), Failure> {
    if table.is_dir() {
        return Err(Failure::write(table, std::io::ErrorKind::IsADirectory.into()));
    }
    match table.exists() && !output::is_stream(table) && !overwrite {
        true => Err(Failure::input(format!("{}: exists already; --overwrite replaces it, or name another", table.display()))),
        false => Ok(()),
    }
}

/// `COLUMN=TOPIC.FIELD[AXIS]`
fn column_map(text: &str) -> Result<ColumnMap, Failure> {
    let wrong = || Failure {
        code: 2,
        message: format!("--map \"{text}\": expected COLUMN=TOPIC.FIELD[AXIS], such as force=/master/servo_jf.effort[0]"),
    };
    let (column, rest) = text.split_once('=').ok_or_else(wrong)?;
    let (topic, field) = rest.rsplit_once('.').ok_or_else(wrong)?;
    let (field, axis) = field.strip_suffix(']').and_then(|f| f.split_once('[')).ok_or_else(wrong)?;
    let quantity = match field {
        "position" => Quantity::Position,
        "velocity" => Quantity::Velocity,
        "effort" => Quantity::Effort,
        _ => return Err(wrong()),
    };
    let axis = axis.parse().map_err(|_| wrong())?;
    Ok(ColumnMap { column: column.to_string(), topic: topic.to_string(), quantity, axis, scale: 1.0, offset: 0.0 })
}

fn export(bag: &Path, csv: &Path, overwrite: bool, topics: &[String]) -> Result<u8, Failure> {
    may_replace(csv, overwrite)?;
    let reader = Reader::open(bag).map_err(Failure::input)?;
    let topics = (!topics.is_empty()).then_some(topics);
    let exporting = format!("exporting {}", bag.display());
    let rows = busy(&exporting, || output::replace(csv, |to| export_csv(&reader, to, topics).map_err(Failure::input)))?;
    output::line(format_args!("{}: {rows} rows", csv.display()))?;
    Ok(0)
}

fn save(damaged: &Path, bag: &Path, overwrite: bool) -> Result<u8, Failure> {
    let report = busy(&format!("recovering {}", damaged.display()), || recover(damaged, bag, overwrite)).map_err(Failure::bag)?;
    if !report.is_lossy() {
        output::line(format_args!("{}: had ended cleanly and is whole; copied", damaged.display()))?;
    }
    let of = report.expected.map_or(String::new(), |all| format!(" of {all}"));
    let until = report.last_step.map_or(String::new(), |step| format!(", up to step {step}"));
    output::line(format_args!("{}: {}{of} messages saved{until}", bag.display(), report.messages))?;
    for (topic, messages) in &report.missing {
        output::line(format_args!("  {topic}: {messages} lost in damaged chunks"))?;
    }
    for place in &report.damaged {
        output::note(format_args!("warning: damaged: {}", place.trim_end_matches("; `backdrive bag recover` saves what is whole")));
    }
    if report.unconfirmed > 0 {
        output::note(format_args!(
            "warning: {} of the saved messages stand in a damaged chunk: index and type agree, but no checksum vouches for their values",
            report.unconfirmed
        ));
    }
    if !report.was_clean {
        output::note(format_args!("warning: {}: had not been closed; what its end held is not known", damaged.display()));
    }
    Ok(if report.is_lossy() { code::LOST_DATA } else { 0 })
}

fn join([a, b]: [&Path; 2], bag: &Path, overwrite: bool, offset_s: Option<f64>, json: bool) -> Result<u8, Failure> {
    check_target(bag, overwrite).map_err(Failure::bag)?;
    let report = busy(&format!("merging into {}", bag.display()), || merge(a, b, bag, offset_s, overwrite)).map_err(Failure::bag)?;
    if json {
        output::json(&report)?;
    } else {
        let (one, other) = report.in_one;
        output::line(format_args!(
            "{}: {} messages, {} of them in both, {one} in the first only, {other} in the second only",
            bag.display(),
            report.messages,
            report.in_both
        ))?;
        if let Some((least, most)) = report.offset_s {
            output::line(format_args!("clock    the second is {least:.6} to {most:.6} s ahead, known to {:.6} s", report.uncertainty_s))?;
        }
    }
    Ok(if report.completeness.lost() > 0 { code::LOST_DATA } else { 0 })
}

fn compare(a: &Path, b: &Path, tolerances: &[String], ignore: &[String], json: bool) -> Result<u8, Failure> {
    let mut options = DiffOptions { ignore: ignore.to_vec(), ..DiffOptions::default() };
    for text in tolerances {
        let parsed = text.rsplit_once('=').and_then(|(topic, value)| Some((topic.to_string(), value.parse::<f64>().ok()?)));
        match parsed {
            Some((topic, value)) if value >= 0.0 => options.tolerances.insert(topic, value),
            _ => {
                return Err(Failure {
                    code: 2,
                    message: format!("--tolerance \"{text}\": expected TOPIC=VALUE with a value of at least 0"),
                });
            }
        };
    }
    let (a, b) = (Reader::open(a).map_err(Failure::input)?, Reader::open(b).map_err(Failure::input)?);
    let report = busy("comparing", || diff(&a, &b, &options)).map_err(Failure::input)?;
    if json {
        output::json(&report)?;
    } else {
        output::text(format_args!("{report}"))?;
    }
    Ok(if report.same { 0 } else { code::NEGATIVE })
}
