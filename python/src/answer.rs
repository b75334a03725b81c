//! What a verb gives Python.

use crate::work::{Worked, worked};
use backdrive::call::called;
use backdrive::caller::Caller;
use backdrive::failure::{Failure, code};
use backdrive_plant::recording::Recording;
use pyo3::exceptions::PyBaseException;
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use std::sync::Arc;

/// The columns of a table: headings, and the bytes of doubles.
type Columns = Vec<(String, Py<PyByteArray>)>;

/// What a verb gave.
#[pyclass(frozen, get_all)]
pub struct Answer {
    /// The exit code of the command line.
    code: u8,
    /// The result as JSON; empty where the verb failed.
    json: String,
    /// What the command line prints for a person; empty where only JSON is made.
    text: String,
    /// Files by name.
    files: Vec<(String, String)>,
    /// Tables by name: the heading of each column, and the bytes of its doubles.
    tables: Vec<(String, Columns)>,
    /// The page, where one was asked for.
    html: Option<String>,
    /// What should be known before the results.
    notes: Vec<String>,
    /// Why there is no result.
    error: Option<String>,
    /// What was raised while it worked: a `KeyboardInterrupt`, or an exception of `progress`.
    raised: Option<Py<PyBaseException>>,
}

/// A table: headings and columns.
pub type Table = Vec<(String, Vec<f64>)>;

/// What the function behind a verb gave, as text.
#[derive(Default)]
pub struct Given {
    pub code: u8,
    pub json: String,
    pub text: String,
    pub files: Vec<(String, String)>,
    pub tables: Vec<(String, Table)>,
    pub html: Option<String>,
}

/// Does the work of a verb in a thread of its own.
///
/// # Errors
/// The work panicked, or was interrupted twice; what else goes wrong is in the answer.
pub fn answered(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&Arc<Caller>) -> Result<Given, Failure> + Send + 'static,
) -> PyResult<Answer> {
    let Worked { result, raised } = worked(py, progress, move |caller| called(caller, || work(caller)))?;
    let (given, notes, error) = match result {
        Some((Ok(given), notes)) => (given, notes, None),
        Some((Err(failure), notes)) => (Given { code: failure.code, ..Given::default() }, notes, Some(failure.message)),
        None => (Given { code: code::INTERRUPTED, ..Given::default() }, Vec::new(), Some("stopped before there was a result".to_string())),
    };
    let Given { code, json, text, files, tables, html } = given;
    let tables = tables.into_iter().map(|(name, table)| (name, columns(py, &table))).collect();
    let raised = raised.map(|error| error.into_value(py));
    Ok(Answer { code, json, text, files, tables, html, notes, error, raised })
}

/// A recording as a table, the time first.
pub fn table_of(recording: Recording) -> Table {
    std::iter::once(("t".to_string(), recording.t)).chain(recording.signals).collect()
}

/// The columns of a table as memory that NumPy takes without a copy.
fn columns(py: Python<'_>, table: &Table) -> Columns {
    let bytes = |column: &[f64]| column.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    table.iter().map(|(name, column)| (name.clone(), PyByteArray::new(py, &bytes(column)).unbind())).collect()
}
