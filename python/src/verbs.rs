//! Verbs with typed arguments: each calls the function behind the verb, and its answer stays in memory.

use crate::answer::{Answer, Given as Gave, answered, table_of};
use crate::given::{Driver, Given, Single, choice, plain, positive, usage};
use backdrive::compare::Done;
use backdrive::compare::links::Links;
use backdrive::diagnose;
use backdrive::failure::{Failure, code};
use backdrive::fit::Refit;
use backdrive::fleet::{Survey, Surveyed};
use backdrive::inspect::inspected;
use backdrive::model_run::Run;
use backdrive::simulate::simulated;
use backdrive::stability::{GRIPS, Judged, spaced};
use backdrive::why::Explained;
use backdrive_answers::asked::Asked;
use backdrive_control::coupling::LawKind;
use backdrive_diagnosis::options::Options;
use backdrive_inspect::{Options as Reading, Source};
use backdrive_nodes::graph::{Hand, Limits, Overrides, Sensors};
use backdrive_predict::fit::Options as Fitting;
use backdrive_predict::simulate::{Driver as By, Options as Running};
use backdrive_stability::asked::Options as Judging;
use backdrive_stability::compare::Rival;
use backdrive_stability::compare::asked::Options as Comparing;
use pyo3::prelude::*;
use serde_json::Value;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Samples per second of an excitation, where nothing else is asked.
const USUAL_RATE: f64 = 5000.0;

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
    set: Given,
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
        let asked = Asked { set: set.recordings()?, model, grip, ignore_signal, options };
        let opened = diagnose::read(&asked)?;
        let (found, steps) = match &out {
            Some(out) => {
                let page = out.join(diagnose::REPORT);
                let written = diagnose::diagnose_into(opened, out, report.then_some(page.as_path()), &caller.stop)?;
                (written.found, written.steps)
            }
            None => diagnose::in_memory(opened, &caller.stop)?,
        };
        Ok(Gave {
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
    set: Given,
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
        let done = Refit::of(
            &Fitting { model, set: set.recordings()?, grip, ignored: ignore_signal, effort, patience },
            None,
            false,
            &caller.stop,
        )?;
        let code = if caller.stop.load(Ordering::SeqCst) { code::INTERRUPTED } else { done.code() };
        let files = vec![("fitted.toml".to_string(), done.model())];
        Ok(Gave { code, json: done.json().to_string(), files, ..Gave::default() })
    })
}

/// Runs a model on recordings or on an excitation.
///
/// # Errors
/// As those of [`diagnose_typed`].
#[pyfunction(name = "simulate")]
#[pyo3(signature = (model, drive, out, *, grip, input, rate, substeps, noise, progress))]
#[allow(clippy::too_many_arguments)] // the keywords of the function in Python
pub fn simulate_typed(
    py: Python<'_>,
    model: PathBuf,
    drive: Driver,
    out: PathBuf,
    grip: Option<PathBuf>,
    input: Option<String>,
    rate: Option<f64>,
    substeps: Option<usize>,
    noise: Option<u64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |_| {
        let drive = match drive {
            Driver::Named(named) => By::Named(named),
            Driver::Set(stated) => By::Set(Box::new(stated.set()?)),
        };
        let options = Running { drive, out, input, rate: rate.unwrap_or(USUAL_RATE), substeps, noise, columns: None };
        let mut tables = Vec::new();
        let mut each = |run: Run| {
            tables.push((run.out.display().to_string(), table_of(run.recording)));
            Ok(())
        };
        let json = simulated(&model, grip.as_deref(), &options, &|_| Ok(()), &mut each)?;
        Ok(Gave { json: json.to_string(), tables, ..Gave::default() })
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
            coupling: choice("coupling", coupling, &LawKind::ALL)?,
            ..Overrides::default()
        })
    }
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
        Ok(Gave { code: judged.code(&caller.stop), json: judged.json()?.to_string(), html: judged.html(), ..Gave::default() })
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
        let all = Rival::all();
        let laws = laws.into_iter().filter_map(|law| choice("laws", Some(law), &all).transpose()).collect::<Result<Vec<_>, _>>()?;
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
        Ok(Gave { code, json: pretty(&done.json())?, html: Some(done.html()), ..Gave::default() })
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
        Ok(Gave { code: found.code(), json: pretty(&found.json()?)?, html: Some(found.html()), ..Gave::default() })
    })
}

/// Checks recordings without a model.
///
/// # Errors
/// As those of [`diagnose_typed`].
#[pyfunction(name = "inspect")]
#[pyo3(signature = (recordings, *, rate, columns, time, progress))]
pub fn inspect_typed(
    py: Python<'_>,
    recordings: Vec<Single>,
    rate: Option<f64>,
    columns: Option<Vec<String>>,
    time: Option<String>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |_| {
        if let Some(rate) = rate.filter(|rate| !(rate.is_finite() && *rate > 0.0) || time.is_some()) {
            return Err(usage(format!("rate is {rate}, and must be above 0, of tables without a column of times")));
        }
        let source = |given: Single| match given {
            Single::Path(path) => Source::Path(path),
            Single::Frame(name, columns) => Source::Columns { name, columns: plain(columns) },
        };
        let sources: Vec<Source> = recordings.into_iter().map(source).collect();
        let found = inspected(&sources, &Reading { rate_hz: rate, columns, time })?;
        Ok(Gave { code: found.code(), json: pretty(&found.json()?)?, html: Some(found.html()), ..Gave::default() })
    })
}

/// Answers for the recordings of a shard, and analyses the table once it is whole.
///
/// # Errors
/// As those of [`diagnose_typed`].
#[pyfunction(name = "fleet")]
#[pyo3(signature = (manifest, *, model, what, shard, jobs, out, false_discoveries, progress))]
#[allow(clippy::too_many_arguments)] // the keywords of the function in Python
pub fn fleet_typed(
    py: Python<'_>,
    manifest: PathBuf,
    model: Option<PathBuf>,
    what: String,
    shard: (usize, usize),
    jobs: usize,
    out: PathBuf,
    false_discoveries: f64,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |caller| {
        let what = what.parse().map_err(|why| usage(format!("what: {why}")))?;
        if !(1..=shard.1).contains(&shard.0) {
            return Err(usage(format!("shard is {}/{}, and the first number must be from 1 to the second", shard.0, shard.1)));
        }
        let asked = Survey { manifest, model, what, shard, jobs, out, false_discoveries };
        let found = Surveyed::of(&asked, &caller.stop)?;
        Ok(Gave { code: found.code(), json: found.json()?.to_string(), ..Gave::default() })
    })
}

/// JSON that a person can read.
pub fn pretty(value: &Value) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map_err(Failure::input)
}
