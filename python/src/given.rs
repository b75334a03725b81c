//! What Python hands over: arrays, recordings in memory, parts of a loop.

use backdrive::failure::{Failure, code};
use backdrive_plant::recording::Frame;
use backdrive_plant::set::RecordingSet;
use backdrive_sets::Recordings;
use pyo3::buffer::PyBuffer;
use pyo3::prelude::*;
use std::path::PathBuf;

/// A column: anything that gives its doubles by Python's buffer protocol, such as an array of NumPy.
pub struct Array(pub Vec<f64>);

impl<'py> FromPyObject<'_, 'py> for Array {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Array> {
        PyBuffer::<f64>::get(&given)?.to_vec(given.py()).map(Array)
    }
}

/// The columns of a table, each with its heading.
pub type Columns = Vec<(String, Array)>;

/// The same as plain numbers.
pub fn plain(columns: Columns) -> Vec<(String, Vec<f64>)> {
    columns.into_iter().map(|(heading, Array(values))| (heading, values)).collect()
}

/// Recordings of a diagnosis or a fit.
#[derive(FromPyObject)]
pub enum Given {
    /// A set, or recordings, as files.
    Files(Vec<PathBuf>),
    /// A set whose recordings may be in memory.
    Set(Stated),
}

/// A set that is stated by a program.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Stated {
    /// What stands in a `set.toml`; files have whole paths.
    settings: String,
    /// The recordings in memory, by the names that they have there.
    frames: Vec<(String, Columns)>,
}

impl Given {
    /// As the work takes them.
    pub fn recordings(self) -> Result<Recordings, Failure> {
        match self {
            Given::Files(paths) => Ok(paths.into()),
            Given::Set(stated) => Ok(Recordings::Set(Box::new(stated.set()?))),
        }
    }
}

impl Stated {
    /// As the work takes it.
    pub fn set(self) -> Result<RecordingSet, Failure> {
        let frames = self.frames.into_iter().map(|(name, columns)| Frame::new(name, plain(columns)));
        Ok(RecordingSet::in_memory(&self.settings, PathBuf::new(), frames.collect::<Result<_, _>>()?)?)
    }
}

/// What a model is simulated on.
#[derive(FromPyObject)]
pub enum Driver {
    /// A file, a folder, or an excitation.
    Named(String),
    /// A set of recordings.
    Set(Stated),
}

/// One recording.
#[derive(FromPyObject)]
pub enum Single {
    /// A file or a folder.
    Path(PathBuf),
    /// Its name and its columns.
    Frame(String, Columns),
}

/// What a word means, written with `_` or `-`.
pub fn choice<T: Copy>(name: &str, word: Option<String>, all: &[(&str, T)]) -> Result<Option<T>, Failure> {
    let Some(word) = word else { return Ok(None) };
    let plain = word.replace('-', "_");
    let words: Vec<&str> = all.iter().map(|(word, _)| *word).collect();
    let found = all.iter().find(|(known, _)| *known == plain).map(|(_, meaning)| Some(*meaning));
    found.ok_or_else(|| usage(format!("{name} is \"{word}\", and must be one of {}", words.join(", "))))
}

/// A number above 0, where there is one.
pub fn positive(name: &str, value: Option<f64>) -> Result<(), Failure> {
    match value.filter(|x| !(x.is_finite() && *x > 0.0)) {
        Some(x) => Err(usage(format!("{name} is {x}, and must be above 0"))),
        None => Ok(()),
    }
}

/// An argument that cannot be used.
pub fn usage(message: String) -> Failure {
    Failure { code: code::USAGE, message }
}
