//! Verbs with typed arguments: each calls the function behind the verb, and its answer stays in memory.

use crate::work::{Worked, worked};
use backdrive::call::called;
use backdrive::caller::Caller;
use backdrive::diagnose;
use backdrive::failure::{Failure, code};
use backdrive::fit::Refit;
use backdrive::inspect::inspected;
use backdrive::model_run::Run;
use backdrive::simulate::simulated;
use backdrive::why::Explained;
use backdrive_answers::asked::Asked;
use backdrive_diagnosis::options::Options;
use backdrive_inspect::Options as Reading;
use backdrive_plant::recording::Recording;
use backdrive_predict::fit::Options as Fitting;
use backdrive_predict::simulate::Options as Running;
use pyo3::exceptions::PyBaseException;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::Value;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Samples per second of an excitation, where nothing else is asked.
const USUAL_RATE: f64 = 5000.0;

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
    tables: Vec<(String, Vec<(String, Py<PyBytes>)>)>,
    /// The page, where one was asked for.
    html: Option<String>,
    /// What should be known before the results.
    notes: Vec<String>,
    /// Why there is no result.
    error: Option<String>,
    /// What was raised while it worked: a `KeyboardInterrupt`, or an exception of `progress`.
    raised: Option<Py<PyBaseException>>,
}

/// What the function behind a verb gave, as text.
#[derive(Default)]
struct Given {
    code: u8,
    json: String,
    text: String,
    files: Vec<(String, String)>,
    tables: Vec<(String, Recording)>,
    html: Option<String>,
}

/// Does the work of a verb in a thread of its own.
fn answered(
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

/// The columns of a table, the time first.
fn columns(py: Python<'_>, table: &Recording) -> Vec<(String, Py<PyBytes>)> {
    let bytes = |column: &[f64]| column.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let signals = table.signals.iter().map(|(name, samples)| (name.as_str(), samples.as_slice()));
    let all = std::iter::once(("t", table.t.as_slice())).chain(signals);
    all.map(|(name, column)| (name.to_string(), PyBytes::new(py, &bytes(column)).unbind())).collect()
}

/// A limit on the clock of so many seconds.
fn patience(seconds: Option<f64>) -> Result<Option<Duration>, Failure> {
    let wrong = |s: f64| Failure { code: code::USAGE, message: format!("patience is {s}, and must be above 0") };
    let limit = |s: f64| Duration::try_from_secs_f64(s).ok().filter(|limit| !limit.is_zero()).ok_or_else(|| wrong(s));
    seconds.map(limit).transpose()
}

/// Diagnoses. `set` is a set or recordings; `out` a folder that is written, where one is given.
///
/// # Errors
/// The work panicked, or was interrupted twice; what else goes wrong is in the answer.
#[pyfunction(name = "diagnose")]
#[pyo3(signature = (set, *, model, grip, ignore_signal, without, effects, effort, seconds, out, report, progress))]
#[allow(clippy::too_many_arguments)] // the keywords of the function in Python
pub fn diagnose_typed(
    py: Python<'_>,
    set: Vec<PathBuf>,
    model: Option<PathBuf>,
    grip: Option<PathBuf>,
    ignore_signal: Vec<String>,
    without: Vec<String>,
    effects: Option<i64>,
    effort: Option<f64>,
    seconds: Option<f64>,
    out: Option<PathBuf>,
    report: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |caller| {
        let effects = effects.map(|effects| usize::try_from(effects).unwrap_or(0)); // 0 is refused as a negative count is
        let options = Options { without, effects, effort, patience: patience(seconds)?, corner_hz: None };
        let asked = Asked { set, model, grip, ignore_signal, options };
        let opened = diagnose::read(&asked)?;
        let (found, steps) = match &out {
            Some(out) => {
                let page = out.join(diagnose::REPORT);
                let written = diagnose::diagnose_into(opened, out, report.then_some(page.as_path()), &caller.stop)?;
                (written.found, written.steps)
            }
            None => diagnose::in_memory(opened, &caller.stop)?,
        };
        Ok(Given {
            code: diagnose::ended(&found, &caller.stop),
            json: String::new(),
            text: found.text(),
            files: found.files()?,
            tables: Vec::new(),
            html: report.then(|| diagnose::html(&found, &steps)),
        })
    })
}

/// Refits the parameters of a model.
///
/// # Errors
/// As those of [`diagnose_typed`].
#[pyfunction(name = "fit")]
#[pyo3(signature = (model, set, *, grip, ignore_signal, effort, seconds, progress))]
#[allow(clippy::too_many_arguments)] // the keywords of the function in Python
pub fn fit_typed(
    py: Python<'_>,
    model: PathBuf,
    set: Vec<PathBuf>,
    grip: Option<PathBuf>,
    ignore_signal: Vec<String>,
    effort: Option<f64>,
    seconds: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |caller| {
        let effort = effort.unwrap_or(1.0);
        if !(effort.is_finite() && effort > 0.0) {
            return Err(Failure { code: code::USAGE, message: format!("effort is {effort}, and must be above 0") });
        }
        let patience = patience(seconds)?.unwrap_or_else(Options::usual_patience);
        let done = Refit::of(&Fitting { model, set, grip, ignored: ignore_signal, effort, patience }, None, false, &caller.stop)?;
        let code = if caller.stop.load(Ordering::SeqCst) { code::INTERRUPTED } else { done.code() };
        let files = vec![("fitted.toml".to_string(), done.model())];
        Ok(Given { code, json: done.json().to_string(), files, ..Given::default() })
    })
}

/// Runs a model on recordings or on an excitation.
///
/// # Errors
/// As those of [`diagnose_typed`].
#[pyfunction(name = "simulate")]
#[pyo3(signature = (model, drive, out, *, grip, input, rate, substeps, noise, columns, progress))]
#[allow(clippy::too_many_arguments)] // the keywords of the function in Python
pub fn simulate_typed(
    py: Python<'_>,
    model: PathBuf,
    drive: String,
    out: PathBuf,
    grip: Option<PathBuf>,
    input: Option<String>,
    rate: Option<f64>,
    substeps: Option<usize>,
    noise: Option<u64>,
    columns: Option<PathBuf>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |_| {
        let options = Running { drive, out, input, rate: rate.unwrap_or(USUAL_RATE), substeps, noise, columns };
        let mut tables = Vec::new();
        let mut each = |run: Run| {
            tables.push((run.out.display().to_string(), run.recording));
            Ok(())
        };
        let json = simulated(&model, grip.as_deref(), &options, &|_| Ok(()), &mut each)?;
        Ok(Given { json: json.to_string(), tables, ..Given::default() })
    })
}

/// Asks why a recorded loop shakes.
///
/// # Errors
/// As those of [`diagnose_typed`].
#[pyfunction(name = "why")]
#[pyo3(signature = (recording, *, roles, progress))]
pub fn why_typed(py: Python<'_>, recording: PathBuf, roles: Option<PathBuf>, progress: Option<Py<PyAny>>) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |caller| {
        let found = Explained::of(&recording, roles.as_deref(), None, &caller.stop)?;
        Ok(Given { code: found.code(), json: pretty(&found.json()?)?, html: Some(found.html()), ..Given::default() })
    })
}

/// Checks recordings without a model.
///
/// # Errors
/// As those of [`diagnose_typed`].
#[pyfunction(name = "inspect")]
#[pyo3(signature = (files, *, rate, columns, time, progress))]
pub fn inspect_typed(
    py: Python<'_>,
    files: Vec<PathBuf>,
    rate: Option<f64>,
    columns: Option<Vec<String>>,
    time: Option<String>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |_| {
        if let Some(rate) = rate.filter(|rate| !(rate.is_finite() && *rate > 0.0) || time.is_some()) {
            let message = format!("rate is {rate}, and must be above 0, of tables without a column of times");
            return Err(Failure { code: code::USAGE, message });
        }
        let found = inspected(&files, &Reading { rate_hz: rate, columns, time })?;
        Ok(Given { code: found.code(), json: pretty(&found.json()?)?, html: Some(found.html()), ..Given::default() })
    })
}

/// JSON that a person can read.
fn pretty(value: &Value) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map_err(Failure::input)
}
