//! What the Python package `backdrive` is built on: verbs of the command line called in this process, tables read and written exactly, model files edited.
//!
//! A verb runs in a thread of its own, and the interpreter's lock is released: other Python threads go on, and Ctrl-C is heard while it works.

mod model;
mod table;

use backdrive::call::{Called, call};
use backdrive::caller::Caller;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Time between two looks at signals and progress.
const LOOK: Duration = Duration::from_millis(20);

/// How long a verb that was interrupted is waited for, unless it is interrupted again.
const PATIENCE: Duration = Duration::from_secs(10);

/// Runs a verb: `(exit code, standard output, notes, error or None)`. `progress(message, position, length or None)` is called now and then.
///
/// # Errors
/// Any exception from a signal handler or `progress`, such as `KeyboardInterrupt`; the verb is then asked to stop.
#[pyfunction]
#[pyo3(signature = (arguments, progress = None))]
fn run(py: Python<'_>, arguments: Vec<String>, progress: Option<Py<PyAny>>) -> PyResult<(u8, String, Vec<String>, Option<String>)> {
    let caller = Arc::new(Caller::default());
    let (done, result) = channel();
    let result = Mutex::new(result);
    let theirs = caller.clone();
    std::thread::Builder::new().name("backdrive".to_string()).spawn(move || {
        // There is no listener any more where the call was interrupted.
        let _ = done.send(call(&arguments, &theirs));
    })?;
    let gone = || PyRuntimeError::new_err("internal error of backdrive; see standard error");
    loop {
        match py.detach(|| heard(&result, LOOK)) {
            Ok(Called { code, result, notes, error }) => return Ok((code, result, notes, error)),
            Err(RecvTimeoutError::Disconnected) => return Err(gone()),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let told = progress.as_ref().zip(caller.progress()).map(|(tell, now)| tell.call1(py, (now.message, now.position, now.length)));
        if let Err(raised) = py.check_signals().and(told.transpose().map(|_| ())) {
            caller.stop.store(true, Ordering::SeqCst);
            let until = Instant::now() + PATIENCE;
            while matches!(py.detach(|| heard(&result, LOOK)), Err(RecvTimeoutError::Timeout)) && Instant::now() < until {
                py.check_signals()?;
            }
            return Err(raised);
        }
    }
}

/// What the verb gives, if it ends within this time.
fn heard(result: &Mutex<Receiver<Called>>, within: Duration) -> Result<Called, RecvTimeoutError> {
    result.lock().map_err(|_| RecvTimeoutError::Disconnected)?.recv_timeout(within)
}

#[pymodule]
fn _backdrive(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(run, module)?)?;
    module.add_function(wrap_pyfunction!(table::write_table, module)?)?;
    module.add_function(wrap_pyfunction!(table::read_table, module)?)?;
    module.add_function(wrap_pyfunction!(model::patched, module)?)?;
    module.add_function(wrap_pyfunction!(model::anywhere, module)?)?;
    module.add_function(wrap_pyfunction!(model::without, module)?)?;
    module.add_function(wrap_pyfunction!(model::value_at, module)?)
}
