//! What the Python package `backdrive` is built on: the typed functions behind the verbs, tables written and model files edited.
//!
//! A verb works in a thread of its own, and the interpreter's lock is released: other Python threads go on, and Ctrl-C is heard while it works.

mod answer;
mod files;
mod given;
mod model;
mod table;
mod verbs;
mod work;

use backdrive::program::Called;
use pyo3::prelude::*;
use std::ffi::OsString;

/// The command line with these arguments; `command` starts another process of it. Gives the exit code.
#[pyfunction]
fn command_line(py: Python<'_>, arguments: Vec<OsString>, command: Vec<String>) -> u8 {
    py.detach(|| backdrive::main_as(Called { arguments, command }))
}

#[pymodule]
fn _backdrive(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(command_line, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::diagnose_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::fit_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::fleet_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::simulate_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::stability_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::compare_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::why_typed, module)?)?;
    module.add_function(wrap_pyfunction!(verbs::inspect_typed, module)?)?;
    module.add_function(wrap_pyfunction!(files::export_typed, module)?)?;
    module.add_function(wrap_pyfunction!(files::describe_typed, module)?)?;
    module.add_function(wrap_pyfunction!(files::load_bag_typed, module)?)?;
    module.add_function(wrap_pyfunction!(files::save_bag_typed, module)?)?;
    module.add_function(wrap_pyfunction!(table::write_table, module)?)?;
    module.add_function(wrap_pyfunction!(model::patched, module)?)?;
    module.add_function(wrap_pyfunction!(model::anywhere, module)?)?;
    module.add_function(wrap_pyfunction!(model::without, module)?)?;
    module.add_function(wrap_pyfunction!(model::value_at, module)?)
}
