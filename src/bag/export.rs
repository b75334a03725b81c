//! `backdrive bag export`

use crate::cli::{BagExport, ExportTo};
use crate::failure::{Failure, code};
use crate::output;
use crate::progress::busy;
use backdrive_bags::{Account, Contract, Fault, Reader, TableFormat, export_lerobot, export_table, is_lerobot};
use std::path::Path;

/// A bag's signals as a table, or bags as a dataset.
pub fn export(asked: &BagExport) -> Result<u8, Failure> {
    let format = match asked.to.or_else(|| ending(&asked.out)) {
        Some(ExportTo::Lerobot) => return dataset(asked),
        Some(ExportTo::Parquet) => TableFormat::Parquet,
        Some(ExportTo::Mat) => TableFormat::Mat,
        None if TableFormat::of_ending(&asked.out) == Some(TableFormat::Numpy) => TableFormat::Numpy,
        Some(ExportTo::Csv) | None => TableFormat::Csv,
    };
    let usage = |message: &str| Failure { code: 2, message: message.to_owned() };
    let [bag] = asked.bags.as_slice() else { return Err(usage("several bags become the episodes of a dataset alone, with --to lerobot")) };
    if asked.contract.is_some() || asked.task.is_some() {
        return Err(usage("--contract and --task are for --to lerobot"));
    }
    apart(&asked.out, bag)?;
    output::may_replace(&asked.out, asked.overwrite)?;
    let reader = Reader::open(bag).map_err(Failure::input)?;
    let topics = (!asked.topic.is_empty()).then_some(asked.topic.as_slice());
    let exporting = format!("exporting {}", bag.display());
    let (rows, notes) =
        busy(&exporting, || output::replace(&asked.out, |to| export_table(&reader, to, format, topics).map_err(Failure::input)))?;
    for note in notes {
        output::note(format_args!("warning: {}: {note}", asked.out.display()));
    }
    output::line(format_args!("{}: {rows} rows", asked.out.display()))?;
    whole(&[reader], topics)
}

/// The exit code of what was written of bags: what of them is missing is missing in it too, and is said.
fn whole(bags: &[Reader], topics: Option<&[String]>) -> Result<u8, Failure> {
    let mut code = 0;
    for bag in bags {
        let path = bag.path().display();
        let account = busy(&format!("counting {path}"), || Account::of(bag)).map_err(Failure::bag)?;
        let counts = |fault: &&Fault| match (fault, topics) {
            (Fault::Lost { topic, .. }, Some(topics)) => topics.contains(topic),
            _ => true,
        };
        let faults: Vec<&Fault> = account.faults.iter().filter(counts).collect();
        if account.empty_steps > 0 && !faults.is_empty() {
            let of = account.last_step.map_or(0, |last| last + 1);
            output::note(format_args!(
                "warning: {path}: {} of {of} rows are missing, because no topic has a message for these steps",
                account.empty_steps
            ));
        }
        for fault in &faults {
            output::note(format_args!("warning: {path}: {fault}"));
        }
        for note in &account.notes {
            output::note(format_args!("note: {path}: {note}"));
        }
        if !faults.is_empty() {
            code = code::LOST_DATA;
        }
    }
    Ok(code)
}

/// What is written replaces what is there: no bag that is read may be it, or in it.
fn apart(out: &Path, bag: &Path) -> Result<(), Failure> {
    match (out.canonicalize(), bag.canonicalize()) {
        (Ok(there), Ok(read)) if read.starts_with(&there) => {
            Err(Failure::input(format!("{}: would replace {}, which is an input; name another place", out.display(), bag.display())))
        }
        _ => Ok(()),
    }
}

fn ending(out: &Path) -> Option<ExportTo> {
    Some(match TableFormat::of_ending(out)? {
        TableFormat::Numpy => return None,
        TableFormat::Csv => ExportTo::Csv,
        TableFormat::Parquet => ExportTo::Parquet,
        TableFormat::Mat => ExportTo::Mat,
    })
}

/// The folder is there whole or not at all: it is written beside its place and then moved there.
fn dataset(asked: &BagExport) -> Result<u8, Failure> {
    let out = &asked.out;
    if !asked.topic.is_empty() {
        return Err(Failure { code: 2, message: "--topic is for tables; a dataset contains all joints of the bag".to_owned() });
    }
    let is_free = !out.exists() || std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_none());
    if !is_free && !is_lerobot(out) {
        return Err(Failure::input(format!("{}: exists and is not a LeRobot dataset, so it is not replaced; name another", out.display())));
    }
    if !is_free && !asked.overwrite {
        return Err(Failure::input(format!("{}: exists already; --overwrite replaces it, or name another", out.display())));
    }
    asked.bags.iter().try_for_each(|bag| apart(out, bag))?;
    let contract = asked.contract.as_deref().map(Contract::read).transpose()?.unwrap_or_default();
    let readers = asked.bags.iter().map(|bag| Reader::open(bag).map_err(Failure::input)).collect::<Result<Vec<_>, _>>()?;
    let task = asked.task.clone().unwrap_or_else(|| "not given".to_owned());
    let failed = |e: std::io::Error| Failure::write(out, e);
    let above = out.parent().filter(|above| !above.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(above).map_err(failed)?;
    let beside = tempfile::Builder::new().prefix(".backdrive-").tempdir_in(above).map_err(failed)?;
    let made = beside.path().join("dataset");
    let report = busy("exporting", || export_lerobot(&readers, &made, &contract, &task)).map_err(Failure::bag)?;
    let before = beside.path().join("before");
    let replaces = out.exists();
    if replaces {
        std::fs::rename(out, &before).map_err(failed)?;
    }
    if let Err(e) = std::fs::rename(&made, out) {
        // What was there is there still.
        if replaces {
            std::fs::rename(&before, out).map_err(failed)?;
        }
        return Err(failed(e));
    }
    for note in &report.notes {
        output::note(format_args!("warning: {note}"));
    }
    let joints = report.joints.join(", ");
    output::line(format_args!(
        "{}: {} episodes, {} rows at {} Hz, joints {joints}",
        out.display(),
        readers.len(),
        report.rows,
        report.fps
    ))?;
    whole(&readers, None)
}
