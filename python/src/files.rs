//! Models and bags as other forms: exported, described, read and written.

use crate::answer::{Answer, Given as Gave, answered};
use crate::given::{Given, Single, choice, plain, positive};
use crate::verbs::pretty;
use backdrive::export::{ended, exported_into};
use backdrive::failure::Failure;
use backdrive_bags::{BagError, ColumnMap, ImportOptions, Reader, check_target, frame_of, import_frame, import_table};
use backdrive_export::feedforward::Language;
use backdrive_export::target::{self, Target};
use backdrive_plant::recording::Frame;
use backdrive_predict::export::Options as Exporting;
use backdrive_predict::show::{Options as Showing, described};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Writes a model in another form; `out` is a file, where one is given.
///
/// # Errors
/// The work panicked, or was interrupted twice; what else goes wrong is in the answer.
#[pyfunction(name = "export")]
#[pyo3(signature = (model, to, *, language, width, step, on, out, overwrite, progress))]
#[allow(clippy::too_many_arguments)] // the keywords of the function in Python
pub fn export_typed(
    py: Python<'_>,
    model: PathBuf,
    to: String,
    language: Option<String>,
    width: Option<f64>,
    step: Option<f64>,
    on: Option<Given>,
    out: Option<PathBuf>,
    overwrite: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |_| {
        positive("width", width)?;
        positive("step", step)?;
        let to = choice("to", Some(to), &Target::ALL.map(|to| (to.word(), to)))?.unwrap_or(Target::Mjcf);
        let language = choice("language", language, &Language::ALL)?.unwrap_or_default();
        let on = on.map(Given::recordings).transpose()?;
        let options = Exporting { model, how: target::Options { to, language, width, step }, on, ignored: Vec::new() };
        let done = exported_into(&options, out.as_deref(), overwrite)?;
        let json = pretty(&done.json(out.as_deref()))?;
        Ok(Gave { code: ended(&done), json, text: done.exported.text, ..Gave::default() })
    })
}

/// Describes a model.
///
/// # Errors
/// As of [`export_typed`].
#[pyfunction(name = "describe")]
#[pyo3(signature = (model, *, grip, amplitude, progress))]
pub fn describe_typed(
    py: Python<'_>,
    model: PathBuf,
    grip: Option<PathBuf>,
    amplitude: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |_| {
        let described = described(&Showing { model, grip, amplitude })?;
        let json = serde_json::to_string(&described).map_err(Failure::input)?;
        Ok(Gave { json, ..Gave::default() })
    })
}

/// Reads the signals of a bag as a table.
///
/// # Errors
/// As of [`export_typed`].
#[pyfunction(name = "load_bag")]
#[pyo3(signature = (path, *, topics, progress))]
pub fn load_bag_typed(py: Python<'_>, path: PathBuf, topics: Option<Vec<String>>, progress: Option<Py<PyAny>>) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |_| {
        let read = || frame_of(&Reader::open(&path)?, topics.as_deref());
        Ok(Gave { tables: vec![("bag".to_string(), read().map_err(Failure::bag)?)], ..Gave::default() })
    })
}

/// Writes a recording as a bag. `map` has the place of a column, as `TOPIC.FIELD[AXIS]`.
///
/// # Errors
/// As of [`export_typed`].
#[pyfunction(name = "save_bag")]
#[pyo3(signature = (recording, path, *, map, overwrite, progress))]
pub fn save_bag_typed(
    py: Python<'_>,
    recording: Single,
    path: PathBuf,
    map: Vec<(String, String)>,
    overwrite: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    answered(py, progress.as_ref(), move |_| {
        let columns = map.iter().map(|(column, place)| ColumnMap::at(column, place)).collect::<Result<_, BagError>>();
        let options = ImportOptions { columns: columns.map_err(Failure::bag)?, overwrite, ..ImportOptions::default() };
        check_target(&path, overwrite).map_err(Failure::bag)?;
        let written = match recording {
            Single::Path(from) => import_table(&from, &path, &options),
            Single::Frame(name, columns) => import_frame(Frame::new(name, plain(columns))?, &path, &options),
        };
        written.map_err(Failure::bag)?;
        Ok(Gave::default())
    })
}
