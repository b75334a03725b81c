//! What the Python package `backdrive` is built on: verbs as typed functions, others called by their arguments, tables read and written exactly, model
//! files edited.
//!
//! A verb works in a thread of its own, and the interpreter's lock is released: other Python threads go on, and Ctrl-C is heard while it works.

mod model;
mod table;
mod verbs;
mod work;

use backdrive::call::{Called, call};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use work::worked;

/// Runs a verb: `(exit code, standard output, notes, error or None)`. `progress(message, position, length or None)` is called now and then.
///
/// # Errors
/// Any exception from a signal handler or `progress`, such as `KeyboardInterrupt`; the verb is then asked to stop.
#[pyfunction]
#[pyo3(signature = (arguments, progress = None))]
fn run(py: Python<'_>, arguments: Vec<String>, progress: Option<Py<PyAny>>) -> PyResult<(u8, String, Vec<String>, Option<String>)> {
    let done = worked(py, progress.as_ref(), move |caller| call(&arguments, caller))?;
    match (done.result, done.raised) {
        (Some(Called { code, result, notes, error }), None) => Ok((code, result, notes, error)),
        (_, Some(raised)) => Err(raised),
        (None, None) => Err(PyRuntimeError::new_err("the verb gave nothing")),
    }
}

#[pymodule]
fn _backdrive(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(run, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::diagnose_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::fit_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::simulate_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::stability_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::compare_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::why_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::inspect_typed, module)?)?;
    module.add_function(wrap_pyfunction!(table::write_table, module)?)?;
    module.add_function(wrap_pyfunction!(table::read_table, module)?)?;
    module.add_function(wrap_pyfunction!(model::patched, module)?)?;
    module.add_function(wrap_pyfunction!(model::anywhere, module)?)?;
    module.add_function(wrap_pyfunction!(model::without, module)?)?;
    module.add_function(wrap_pyfunction!(model::value_at, module)?)
}
