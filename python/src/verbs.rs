//! Verbs with typed arguments: each calls the function behind the verb, and its answer stays in memory.

use crate::work::{Worked, worked};
use backdrive::call::called;
use backdrive::caller::Caller;
use backdrive::compare::Done;
use backdrive::compare::links::Links;
use backdrive::diagnose;
use backdrive::failure::{Failure, code};
use backdrive::fit::Refit;
use backdrive::inspect::inspected;
use backdrive::model_run::Run;
use backdrive::simulate::simulated;
use backdrive::stability::{GRIPS, Judged, spaced};
use backdrive::why::Explained;
use backdrive_answers::asked::Asked;
use backdrive_control::coupling::Law;
use backdrive_diagnosis::options::Options;
use backdrive_inspect::Options as Reading;
use backdrive_nodes::graph::{Hand, Limits, Overrides, Sensors};
use backdrive_plant::recording::Recording;
use backdrive_predict::fit::Options as Fitting;
use backdrive_predict::simulate::Options as Running;
use backdrive_stability::asked::Options as Judging;
use backdrive_stability::compare::Rival;
use backdrive_stability::compare::asked::Options as Comparing;
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

/// The columns of a table: headings, and the bytes of doubles.
type Columns = Vec<(String, Py<PyBytes>)>;

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
fn columns(py: Python<'_>, table: &Recording) -> Columns {
    let bytes = |column: &[f64]| column.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let signals = table.signals.iter().map(|(name, samples)| (name.as_str(), samples.as_slice()));
    let all = std::iter::once(("t", table.t.as_slice())).chain(signals);
    all.map(|(name, column)| (name.to_string(), PyBytes::new(py, &bytes(column)).unbind())).collect()
}

/// A limit on the clock of so many seconds.
fn patience(seconds: Option<f64>) -> Result<Option<Duration>, Failure> {
    let wrong = |s: f64| usage(format!("patience is {s}, and must be above 0"));
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
        positive("effort", Some(effort))?;
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

/// Parts of a loop that are swapped, by their names on the command line; `None` keeps the recorded part.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Parts {
    master: Option<PathBuf>,
    grip: Option<PathBuf>,
    slave: Option<PathBuf>,
    environment: Option<PathBuf>,
    canceller: Option<PathBuf>,
    canceller_grip: Option<PathBuf>,
    high_pass: Option<f64>,
    hand: Option<String>,
    edge_without: Option<f64>,
    sensors: Option<String>,
    limits: Option<String>,
    script: Option<PathBuf>,
}

impl Parts {
    /// As the graph's reader takes them, with the law of the coupling.
    fn overrides(self, coupling: Option<String>) -> Result<Overrides, Failure> {
        let law = coupling.iter().find(|law| !Law::ALL.iter().any(|(name, _)| name == law));
        if let Some(law) = law {
            let laws: Vec<&str> = Law::ALL.iter().map(|(name, _)| *name).collect();
            return Err(usage(format!("coupling is \"{law}\", and must be one of {}", laws.join(", "))));
        }
        if let Some(hz) = self.high_pass.filter(|hz| !(hz.is_finite() && *hz >= 0.0)) {
            return Err(usage(format!("high_pass is {hz}, and must be at least 0")));
        }
        positive("edge_without", self.edge_without)?;
        Ok(Overrides {
            master: self.master,
            grip: self.grip,
            slave: self.slave,
            environment: self.environment,
            canceller: self.canceller,
            canceller_grip: self.canceller_grip,
            high_pass_hz: self.high_pass,
            hand: choice("hand", self.hand, &Hand::ALL)?,
            edge_without: self.edge_without,
            sensors: choice("sensors", self.sensors, &Sensors::ALL)?,
            limits: choice("limits", self.limits, &Limits::ALL)?,
            coupling,
            ..Overrides::default()
        })
    }
}

/// What a word means, written with `_` or `-`.
fn choice<T: Copy>(name: &str, word: Option<String>, all: &[(&str, T)]) -> Result<Option<T>, Failure> {
    let Some(word) = word else { return Ok(None) };
    let plain = word.replace('-', "_");
    let words: Vec<&str> = all.iter().map(|(word, _)| *word).collect();
    let found = all.iter().find(|(known, _)| *known == plain).map(|(_, meaning)| Some(*meaning));
    found.ok_or_else(|| usage(format!("{name} is \"{word}\", and must be one of {}", words.join(", "))))
}

/// A number above 0, where there is one.
fn positive(name: &str, value: Option<f64>) -> Result<(), Failure> {
    match value.filter(|x| !(x.is_finite() && *x > 0.0)) {
        Some(x) => Err(usage(format!("{name} is {x}, and must be above 0"))),
        None => Ok(()),
    }
}

/// An argument that cannot be used.
fn usage(message: String) -> Failure {
    Failure { code: code::USAGE, message }
}

/// Judges the loop of a recording at a gain.
///
/// # Errors
/// As those of [`diagnose_typed`].
#[pyfunction(name = "stability")]
#[pyo3(signature = (recording, *, roles, gain, mu, lambda_, sweep, grips, coupling, parts, progress))]
#[allow(clippy::too_many_arguments)] // the keywords of the function in Python
pub fn stability_typed(
    py: Python<'_>,
    recording: PathBuf,
    roles: Option<PathBuf>,
    gain: Option<f64>,
    mu: Option<f64>,
    lambda_: Option<f64>,
    sweep: Option<(f64, f64, usize)>,
    grips: Option<Vec<f64>>,
    coupling: Option<String>,
    parts: Parts,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |caller| {
        if gain.is_some() && (mu.is_some() || lambda_.is_some()) {
            return Err(usage("gain is the product of mu and lambda_; give it, or these".to_string()));
        }
        let grips = grips.unwrap_or_else(|| GRIPS.to_vec());
        let numbers = [("gain", gain), ("mu", mu), ("lambda_", lambda_)];
        let grip_factors = grips.iter().map(|factor| ("grips", Some(*factor)));
        numbers.into_iter().chain(grip_factors).try_for_each(|(name, value)| positive(name, value))?;
        let sweep = sweep.map(|(from, to, count)| spaced(from, to, count).map_err(|why| usage(format!("sweep: {why}")))).transpose()?;
        let script = parts.script.clone();
        let how = Judging { recording, roles, changes: parts.overrides(coupling)?, gain, mu, lambda: lambda_, script, grips };
        let judged = Judged::of(&how, sweep.as_ref().map(|gains| gains.0.as_slice()), &caller.stop)?;
        Ok(Given { code: judged.code(&caller.stop), json: judged.json()?.to_string(), html: judged.html(), ..Given::default() })
    })
}

/// Compares laws between master and slave, and the canceller, over links and grips.
///
/// # Errors
/// As those of [`diagnose_typed`].
#[pyfunction(name = "compare")]
#[pyo3(signature = (session, *, laws, delays_ms, jitter_ms, loss, grips, at_ms, lambda_, parts, progress))]
#[allow(clippy::too_many_arguments)] // the keywords of the function in Python
pub fn compare_typed(
    py: Python<'_>,
    session: PathBuf,
    laws: Vec<String>,
    delays_ms: Option<Vec<f64>>,
    jitter_ms: Option<Vec<[f64; 2]>>,
    loss: Option<Vec<f64>>,
    grips: Option<Vec<f64>>,
    at_ms: Option<f64>,
    lambda_: Option<f64>,
    parts: Parts,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |caller| {
        let rivals: Vec<&str> = Rival::all().into_iter().map(Rival::word).collect();
        if let Some(law) = laws.iter().find(|law| !rivals.contains(&law.as_str())) {
            return Err(usage(format!("laws has \"{law}\", and each must be one of {}", rivals.join(", "))));
        }
        positive("lambda_", lambda_)?;
        let own = Links::default();
        let links = Links {
            delays_ms: delays_ms.unwrap_or(own.delays_ms),
            jitter_ms: jitter_ms.unwrap_or(own.jitter_ms),
            loss: loss.unwrap_or(own.loss),
            grips: grips.unwrap_or(own.grips),
            at_ms: at_ms.unwrap_or(own.at_ms),
        };
        links.check().map_err(usage)?;
        let changes = Overrides { lambda: lambda_, ..parts.overrides(None)? };
        let done = Done::of(&Comparing { session, laws, changes, conditions: links.conditions() }, &caller.stop)?;
        let code = if caller.stop.load(Ordering::SeqCst) { code::INTERRUPTED } else { 0 };
        Ok(Given { code, json: pretty(&done.json())?, html: Some(done.html()), ..Given::default() })
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
            return Err(usage(format!("rate is {rate}, and must be above 0, of tables without a column of times")));
        }
        let found = inspected(&files, &Reading { rate_hz: rate, columns, time })?;
        Ok(Given { code: found.code(), json: pretty(&found.json()?)?, html: Some(found.html()), ..Given::default() })
    })
}

/// JSON that a person can read.
fn pretty(value: &Value) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map_err(Failure::input)
}
