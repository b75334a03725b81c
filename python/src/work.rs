//! Work in a thread of its own: the interpreter's lock is released, Ctrl-C is heard, and progress is reported.

use backdrive::caller::Caller;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Time between two looks at signals and progress.
const LOOK: Duration = Duration::from_millis(20);

/// How long work that was interrupted is waited for, unless it is interrupted again.
const PATIENCE: Duration = Duration::from_secs(10);

/// What work gave, and what was raised while it went on.
pub struct Worked<T> {
    /// What it gave; `None` where it was interrupted and did not end in time.
    pub result: Option<T>,
    /// An exception of a signal handler or of `progress`, such as `KeyboardInterrupt`: the work was then asked to stop.
    pub raised: Option<PyErr>,
}

/// Works. `progress(message, position, length or None)` is called now and then.
///
/// # Errors
/// The work panicked, no thread could be started, or it was interrupted twice.
pub fn worked<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&Arc<Caller>) -> T + Send + 'static,
) -> PyResult<Worked<T>> {
    let caller = Arc::new(Caller::default());
    let (done, result) = channel();
    let result = Mutex::new(result);
    let theirs = caller.clone();
    std::thread::Builder::new().name("backdrive".to_string()).spawn(move || {
        // There is no listener any more where the call was interrupted.
        let _ = done.send(work(&theirs));
    })?;
    let gone = || PyRuntimeError::new_err("internal error of backdrive; see standard error");
    loop {
        match py.detach(|| heard(&result, LOOK)) {
            Ok(result) => return Ok(Worked { result: Some(result), raised: None }),
            Err(RecvTimeoutError::Disconnected) => return Err(gone()),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let told = progress.zip(caller.progress()).map(|(tell, now)| tell.call1(py, (now.message, now.position, now.length)));
        if let Err(raised) = py.check_signals().and(told.transpose().map(|_| ())) {
            caller.stop.store(true, Ordering::SeqCst);
            let until = Instant::now() + PATIENCE;
            loop {
                match py.detach(|| heard(&result, LOOK)) {
                    Ok(result) => return Ok(Worked { result: Some(result), raised: Some(raised) }),
                    Err(RecvTimeoutError::Timeout) if Instant::now() < until => py.check_signals()?,
                    Err(_) => return Ok(Worked { result: None, raised: Some(raised) }),
                }
            }
        }
    }
}

/// What the work gives, if it ends within this time.
fn heard<T>(result: &Mutex<Receiver<T>>, within: Duration) -> Result<T, RecvTimeoutError> {
    result.lock().map_err(|_| RecvTimeoutError::Disconnected)?.recv_timeout(within)
}
