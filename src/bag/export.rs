//! `backdrive bag export`. The work is that of [`backdrive_bags::Export`].

use crate::cli::{BagExport, ExportTo};
use crate::failure::{Failure, code};
use crate::output;
use crate::progress::busy;
use backdrive_bags::{Contract, Export, ExportFormat, PlannedExport, Reader, TableFormat};
use std::path::Path;

/// A bag's signals as a table, or bags as a dataset.
pub fn export(asked: &BagExport) -> Result<u8, Failure> {
    let export = resolved(asked)?;
    match export.planned().map_err(Failure::bag)? {
        PlannedExport::Table { bag, format } => table(&export, bag, format),
        PlannedExport::Lerobot => dataset(&export),
    }
}

/// The options of the work.
fn resolved(asked: &BagExport) -> Result<Export, Failure> {
    let format = |to: ExportTo| match to {
        ExportTo::Lerobot => ExportFormat::Lerobot,
        ExportTo::Parquet => ExportFormat::Table(TableFormat::Parquet),
        ExportTo::Mat => ExportFormat::Table(TableFormat::Mat),
        ExportTo::Csv => ExportFormat::Table(TableFormat::Csv),
    };
    Ok(Export {
        bags: asked.bags.clone(),
        out: asked.out.clone(),
        to: asked.to.map(format),
        topics: (!asked.topic.is_empty()).then(|| asked.topic.clone()),
        contract: asked.contract.as_deref().map(Contract::read).transpose()?,
        task: asked.task.clone(),
        overwrite: asked.overwrite,
    })
}

fn table(export: &Export, bag: &Path, format: TableFormat) -> Result<u8, Failure> {
    let out = &export.out;
    output::may_replace(out, export.overwrite)?;
    let reader = Reader::open(bag).map_err(Failure::input)?;
    let exporting = format!("exporting {}", bag.display());
    let written = || output::replace(out, |to| export.table(&reader, to, format).map_err(Failure::input));
    let (rows, notes) = busy(&exporting, written)?;
    for note in notes {
        output::note(format_args!("warning: {}: {note}", out.display()));
    }
    output::line(format_args!("{}: {rows} rows", out.display()))?;
    whole(export, &[reader])
}

fn dataset(export: &Export) -> Result<u8, Failure> {
    let readers = export.bags.iter().map(|bag| Reader::open(bag).map_err(Failure::input)).collect::<Result<Vec<_>, _>>()?;
    let report = busy("exporting", || export.dataset(&readers)).map_err(Failure::bag)?;
    for note in &report.notes {
        output::note(format_args!("warning: {note}"));
    }
    let joints = report.joints.join(", ");
    output::line(format_args!(
        "{}: {} episodes, {} rows at {} Hz, joints {joints}",
        export.out.display(),
        readers.len(),
        report.rows,
        report.fps
    ))?;
    whole(export, &readers)
}

/// The exit code of what was written of bags: what of them is missing is missing in it too, and is reported.
fn whole(export: &Export, bags: &[Reader]) -> Result<u8, Failure> {
    let mut code = 0;
    for bag in bags {
        let path = bag.path().display();
        let missing = busy(&format!("counting {path}"), || export.missing(bag)).map_err(Failure::bag)?;
        if missing.empty_rows > 0 {
            let (empty, of) = (missing.empty_rows, missing.rows);
            output::note(format_args!("warning: {path}: {empty} of {of} rows are missing, because no topic has a message for these steps"));
        }
        for fault in &missing.faults {
            output::note(format_args!("warning: {path}: {fault}"));
            code = code::LOST_DATA;
        }
        for note in &missing.notes {
            output::note(format_args!("note: {path}: {note}"));
        }
    }
    Ok(code)
}
