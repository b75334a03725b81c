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

/// As [`read`], of a file that has at least this number of rows.
///
/// # Errors
/// As [`read`], and where it has fewer.
pub fn read_at_least(path: &Path, names: &[&str], rows: usize) -> Result<Vec<Vec<f64>>, StudyError> {
    let columns = read(path, names)?;
    let there = columns.first().map_or(0, Vec::len);
    if there < rows {
        return Err(StudyError::File(format!("{}: has {there} rows, the study needs {rows}: is it the whole recording?", path.display())));
    }
    Ok(columns)
}

/// Writes columns of equal length as a recording.
///
/// # Errors
/// When the file cannot be written.
pub fn write(path: &Path, names: &[&str], columns: &[&[f64]]) -> Result<(), StudyError> {
    let failed = |e: csv::Error| StudyError::Write(format!("{}: cannot be written: {e}", path.display()));
    let mut writer = csv::Writer::from_path(path).map_err(failed)?;
    writer.write_record(names).map_err(failed)?;
    let rows = columns.iter().map(|c| c.len()).min().unwrap_or(0);
    for row in 0..rows {
        writer.write_record(columns.iter().map(|c| format!("{:?}", c[row]))).map_err(failed)?;
    }
    writer.flush().map_err(|e| failed(e.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_with_a_file_is_told_with_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        let told = |text: &str, names: &[&str]| {
            std::fs::write(&path, text).unwrap();
            read(&path, names).unwrap_err().to_string()
        };
        assert!(told("t,x\n0,1\n", &["y"]).ends_with("a.csv: has no column y"));
        assert!(told("t,x\n0,1\n1,one\n", &["x"]).ends_with("a.csv: row 3: \"one\" is no number"));
        assert!(told("t,x\n0,1\n1\n", &["x"]).contains("a.csv: "));
        assert!(read(&folder.path().join("none.csv"), &["x"]).unwrap_err().to_string().contains("none.csv: "));
    }

    #[test]
    fn what_is_written_is_read_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        let x = [0.1 + 0.2, -1e-300, 4.0];
        write(&path, &["t", "x"], &[&[0.0, 1.0, 2.0], &x]).unwrap();
        assert_eq!(read(&path, &["x"]).unwrap(), vec![x.to_vec()]);
        assert!(write(&folder.path().join("no/such.csv"), &["t"], &[&x]).unwrap_err().to_string().contains("cannot be written"));
    }
}
