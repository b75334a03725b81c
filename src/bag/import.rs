//! `backdrive bag import`. The work is that of [`backdrive_bags::Import`].

use crate::cli::BagImport;
use crate::failure::Failure;
use crate::output;
use crate::progress::busy;
use backdrive_bags::{ColumnMap, Contract, Import, ImportOptions, Imported, Report};

/// Recordings of any format into bags.
pub fn import(asked: &BagImport) -> Result<u8, Failure> {
    let import = resolved(asked)?;
    for planned in import.planned().map_err(Failure::bag)? {
        let importing = format!("importing {}", planned.from.display());
        let made = busy(&importing, || import.carry_out(&planned)).map_err(Failure::bag)?;
        made.iter().try_for_each(reported)?;
    }
    Ok(0)
}

/// The options of the work.
fn resolved(asked: &BagImport) -> Result<Import, Failure> {
    let columns = asked.map.iter().map(|map| map.parse()).collect::<Result<Vec<ColumnMap>, _>>().map_err(Failure::bag)?;
    let headings = (!asked.columns.is_empty()).then(|| asked.columns.iter().map(|name| name.trim().to_owned()).collect());
    let table = ImportOptions {
        time: asked.time.clone(),
        columns,
        variable: asked.variable.clone(),
        headings,
        rate_hz: asked.rate,
        overwrite: asked.overwrite,
        most_bytes: asked.memory << 20,
    };
    let contract = asked.contract.as_deref().map(Contract::read).transpose()?;
    let episodes = (!asked.episode.is_empty()).then(|| asked.episode.clone());
    Ok(Import { recordings: asked.recordings.clone(), bag: asked.bag.clone(), table, contract, episodes })
}

/// One bag that was made.
fn reported(made: &Imported) -> Result<(), Failure> {
    let (from, to) = (made.from.display(), made.to.display());
    match &made.report {
        Report::Table(report) => {
            warn(&from.to_string(), &report.notes, &report.clock);
            output::line(format_args!("{from}: {} rows, {} topics -> {to}", report.rows, report.topics.len()))
        }
        Report::Rosbag(report) => {
            warn(&from.to_string(), &report.notes, &[]);
            for topic in &report.topics {
                warn(&format!("{from}: {}", topic.name), &topic.notes, &topic.clock);
            }
            output::line(format_args!("{from}: {} messages, {} topics -> {to}", report.messages, report.topics.len()))
        }
    }
}

fn warn(name: &str, notes: &[String], clock: &[String]) {
    for remark in notes.iter().chain(clock) {
        output::note(format_args!("warning: {name}: {remark}"));
    }
}
