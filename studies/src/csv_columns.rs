//! Columns of a CSV file by name, for what a study computes itself.

use crate::StudyError;
use std::path::Path;

/// Some columns of a file, in the order of `names`; each as long as the file has rows.
///
/// # Errors
/// When the file cannot be read, has no such column, or holds something else than numbers there.
pub fn read(path: &Path, names: &[&str]) -> Result<Vec<Vec<f64>>, StudyError> {
    let failed = |what: String| StudyError::File(format!("{}: {what}", path.display()));
    let mut reader = csv::Reader::from_path(path).map_err(|e| failed(e.to_string()))?;
    let header = reader.headers().map_err(|e| failed(e.to_string()))?.clone();
    let place = |name: &&str| header.iter().position(|h| h.trim() == *name).ok_or_else(|| failed(format!("has no column {name}")));
    let places: Vec<usize> = names.iter().map(place).collect::<Result<_, _>>()?;
    let mut columns = vec![Vec::new(); names.len()];
    for (row, record) in reader.records().enumerate() {
        let record = record.map_err(|e| failed(e.to_string()))?;
        for (column, place) in columns.iter_mut().zip(&places) {
            let cell = record.get(*place).unwrap_or("").trim();
            column.push(cell.parse::<f64>().map_err(|_| failed(format!("row {}: \"{cell}\" is no number", row + 2)))?);
        }
    }
    Ok(columns)
}

/// Writes columns of equal length as a recording.
///
/// # Errors
/// When the file cannot be written.
pub fn write(path: &Path, names: &[&str], columns: &[&[f64]]) -> Result<(), StudyError> {
    let failed = |e: csv::Error| StudyError::File(format!("{}: cannot be written: {e}", path.display()));
    let mut writer = csv::Writer::from_path(path).map_err(failed)?;
    writer.write_record(names).map_err(failed)?;
    let rows = columns.iter().map(|c| c.len()).min().unwrap_or(0);
    for row in 0..rows {
        writer.write_record(columns.iter().map(|c| format!("{:?}", c[row]))).map_err(failed)?;
    }
    writer.flush().map_err(|e| failed(e.into()))
}
