//! `backdrive bag import`

use crate::cli::BagImport;
use crate::failure::Failure;
use crate::output;
use crate::progress::busy;
use backdrive_bags::{
    ColumnMap, Contract, ImportOptions, LerobotOptions, Quantity, check_target, import_lerobot, import_rosbag, import_table, is_lerobot,
    is_rosbag,
};
use std::path::{Path, PathBuf};

/// What a recording is that becomes bags.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// One table, one bag.
    Table,
    /// A folder of episodes, a folder of bags.
    Lerobot,
    /// Topics of somebody else's, one bag.
    Rosbag,
}

/// Recordings of any format into bags.
pub fn import(asked: &BagImport) -> Result<u8, Failure> {
    let columns = asked.map.iter().map(|map| column_map(map)).collect::<Result<Vec<_>, _>>()?;
    // One recording is one experiment and one bag: several go into a folder, as the episodes of a dataset do.
    let into = |from: &Path, kind: Kind| -> PathBuf {
        match (asked.recordings.len(), kind) {
            (1, _) => asked.bag.clone(),
            (_, Kind::Lerobot) => asked.bag.join(from.file_name().unwrap_or_default()),
            _ => asked.bag.join(from.with_extension("mcap").file_name().unwrap_or_default()),
        }
    };
    let kinds = asked.recordings.iter().map(|from| Ok((from.as_path(), kind_of(from, asked)?))).collect::<Result<Vec<_>, Failure>>()?;
    let targets: Vec<PathBuf> = kinds.iter().map(|(from, kind)| into(from, *kind)).collect();
    if let Some(place) = (1..targets.len()).find(|place| targets[..*place].contains(&targets[*place])) {
        let (other, to) = (targets.iter().position(|to| *to == targets[place]).unwrap_or(0), targets[place].display());
        let message =
            format!("{} and {} would both become {to}; import them one by one", kinds[other].0.display(), kinds[place].0.display());
        return Err(Failure { code: 2, message });
    }
    if asked.recordings.len() > 1 {
        std::fs::create_dir_all(&asked.bag).map_err(|e| Failure::write(&asked.bag, e))?;
    }
    for (from, kind) in kinds.iter().filter(|(_, kind)| *kind != Kind::Lerobot) {
        check_target(&into(from, *kind), asked.overwrite).map_err(Failure::bag)?;
    }
    if let (Some(rate), true) = (asked.rate, asked.time != "t") {
        let message = format!("--rate {rate} is for tables in which no column is the time, and --time names {:?}; keep one", asked.time);
        return Err(Failure { code: 2, message });
    }
    let headings = (!asked.columns.is_empty()).then(|| asked.columns.iter().map(|name| name.trim().to_owned()).collect());
    let (overwrite, most_bytes) = (asked.overwrite, asked.memory << 20);
    let table = ImportOptions {
        time: asked.time.clone(),
        columns,
        variable: asked.variable.clone(),
        headings,
        rate_hz: asked.rate,
        overwrite,
        most_bytes,
    };
    let contract = asked.contract.as_deref().map(Contract::read).transpose()?.unwrap_or_default();
    let episodes = (!asked.episode.is_empty()).then(|| asked.episode.clone());
    let dataset = LerobotOptions { contract, episodes, overwrite, most_bytes };
    for (from, kind) in kinds {
        let to = into(from, kind);
        let importing = format!("importing {}", from.display());
        match kind {
            Kind::Table => {
                let report = busy(&importing, || import_table(from, &to, &table)).map_err(Failure::bag)?;
                warn(&from.display().to_string(), &report.notes, &report.clock);
                output::line(format_args!("{}: {} rows, {} topics -> {}", from.display(), report.rows, report.topics.len(), to.display()))?;
            }
            Kind::Lerobot => {
                for episode in busy(&importing, || import_lerobot(from, &to, &dataset)).map_err(Failure::bag)? {
                    let (name, report) = (from.join(&episode.name), episode.report);
                    warn(&name.display().to_string(), &report.notes, &report.clock);
                    output::line(format_args!(
                        "{}: {} rows, {} topics -> {}",
                        name.display(),
                        report.rows,
                        report.topics.len(),
                        episode.bag.display()
                    ))?;
                }
            }
            Kind::Rosbag => {
                let report = busy(&importing, || import_rosbag(from, &to, overwrite, most_bytes)).map_err(Failure::bag)?;
                warn(&from.display().to_string(), &report.notes, &[]);
                for topic in &report.topics {
                    warn(&format!("{}: {}", from.display(), topic.name), &topic.notes, &topic.clock);
                }
                output::line(format_args!(
                    "{}: {} messages, {} topics -> {}",
                    from.display(),
                    report.messages,
                    report.topics.len(),
                    to.display()
                ))?;
            }
        }
    }
    Ok(0)
}

fn warn(name: &str, notes: &[String], clock: &[String]) {
    for remark in notes.iter().chain(clock) {
        output::note(format_args!("warning: {name}: {remark}"));
    }
}

/// What a recording is; an option that is for another kind is wrong usage.
fn kind_of(from: &Path, asked: &BagImport) -> Result<Kind, Failure> {
    if !from.exists() {
        return Err(Failure::input(format!("{}: there is no such file or folder", from.display())));
    }
    let kind = match from {
        from if is_lerobot(from) => Kind::Lerobot,
        from if is_rosbag(from) => Kind::Rosbag,
        from if from.is_dir() => {
            let what =
                "is a folder, but neither a LeRobot dataset (meta/info.json) nor a rosbag2 (metadata.yaml, .db3); name the files in it";
            return Err(Failure::input(format!("{}: {what}", from.display())));
        }
        _ => Kind::Table,
    };
    let no_table = [("--map", !asked.map.is_empty()), ("--variable", asked.variable.is_some()), ("--time", asked.time != "t")];
    let no_table = [&no_table[..], &[("--columns", !asked.columns.is_empty()), ("--rate", asked.rate.is_some())]].concat();
    let no_dataset = [("--contract", asked.contract.is_some()), ("--episode", !asked.episode.is_empty())];
    let wrong = |options: &[(&str, bool)], is_for: &str| match options.iter().find(|(_, given)| *given) {
        Some((option, _)) => Err(Failure { code: 2, message: format!("{}: {option} is for {is_for}", from.display()) }),
        None => Ok(()),
    };
    if kind != Kind::Table {
        wrong(&no_table, "tables: CSV, parquet, MATLAB and NumPy files")?;
    }
    if kind != Kind::Lerobot {
        wrong(&no_dataset, "LeRobot datasets")?;
    }
    Ok(kind)
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
