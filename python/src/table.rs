//! Columns of doubles to and from CSV, digit for digit: the shortest digits that read back to the same bits.

use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

const BYTES: usize = size_of::<f64>();

/// Writes columns, each the bytes of little-endian doubles, under their headings.
///
/// # Errors
/// When columns differ in length, or the file cannot be written.
#[pyfunction]
pub fn write_table(py: Python<'_>, path: PathBuf, names: Vec<String>, columns: Vec<Vec<u8>>) -> PyResult<()> {
    let rows = columns.first().map_or(0, |c| c.len() / BYTES);
    if names.len() != columns.len() || columns.iter().any(|c| c.len() != rows * BYTES) {
        return Err(PyValueError::new_err("every column needs a name and as many samples as the first one"));
    }
    py.detach(|| written(&path, &names, &columns, rows))
        .map_err(|e| PyOSError::new_err(format!("{}: cannot be written: {e}", path.display())))
}

fn written(path: &PathBuf, names: &[String], columns: &[Vec<u8>], rows: usize) -> std::io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    let quoted: Vec<String> = names.iter().map(|name| format!("\"{}\"", name.replace('"', "\"\""))).collect();
    writeln!(out, "{}", quoted.join(","))?;
    for row in 0..rows {
        for (place, column) in columns.iter().enumerate() {
            let mut bytes = [0; BYTES];
            bytes.copy_from_slice(&column[row * BYTES..(row + 1) * BYTES]);
            let value = f64::from_le_bytes(bytes);
            let comma = if place == 0 { "" } else { "," };
            match value.is_nan() {
                true => write!(out, "{comma}nan")?,
                false => write!(out, "{comma}{value:?}")?,
            }
        }
        writeln!(out)?;
    }
    out.flush()
}

/// Reads a table of numbers: its headings, and each column as the bytes of doubles. A cell that is no number is NaN.
///
/// # Errors
/// When the file cannot be read.
#[pyfunction]
pub fn read_table(py: Python<'_>, path: PathBuf) -> PyResult<(Vec<String>, Vec<Py<PyBytes>>)> {
    let read = py.detach(|| -> Result<(Vec<String>, Vec<Vec<u8>>), csv::Error> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_path(&path)?;
        let names: Vec<String> = reader.headers()?.iter().map(str::to_string).collect();
        let mut columns = vec![Vec::new(); names.len()];
        let mut record = csv::StringRecord::new();
        while reader.read_record(&mut record)? {
            for (column, cell) in columns.iter_mut().zip(&record) {
                column.extend_from_slice(&cell.parse().unwrap_or(f64::NAN).to_le_bytes());
            }
        }
        Ok((names, columns))
    });
    let (names, columns) = read.map_err(|e| PyOSError::new_err(format!("{}: {e}", path.display())))?;
    Ok((names, columns.iter().map(|column| PyBytes::new(py, column).unbind()).collect()))
}
