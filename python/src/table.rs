//! Columns of doubles as CSV, digit for digit: the shortest digits that read back to the same bits.

use crate::given::{Columns, plain};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes columns under their headings.
///
/// # Errors
/// When columns differ in length, or the file cannot be written.
#[pyfunction]
pub fn write_table(py: Python<'_>, path: PathBuf, columns: Columns) -> PyResult<()> {
    let columns = plain(columns);
    let rows = columns.first().map_or(0, |(_, column)| column.len());
    if columns.iter().any(|(_, column)| column.len() != rows) {
        return Err(PyValueError::new_err("every column needs as many samples as the first one"));
    }
    py.detach(|| written(&path, &columns, rows)).map_err(|e| PyOSError::new_err(format!("{}: cannot be written: {e}", path.display())))
}

fn written(path: &Path, columns: &[(String, Vec<f64>)], rows: usize) -> std::io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    let quoted: Vec<String> = columns.iter().map(|(name, _)| format!("\"{}\"", name.replace('"', "\"\""))).collect();
    writeln!(out, "{}", quoted.join(","))?;
    for row in 0..rows {
        for (place, (_, column)) in columns.iter().enumerate() {
            let (value, comma) = (column[row], if place == 0 { "" } else { "," });
            match value.is_nan() {
                true => write!(out, "{comma}nan")?,
                false => write!(out, "{comma}{value:?}")?,
            }
        }
        writeln!(out)?;
    }
    out.flush()
}
