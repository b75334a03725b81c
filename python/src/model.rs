//! Model files read and edited, their comments and order kept.

use backdrive_plant::model::Model;
use backdrive_plant::write::{Edit, Value, patch};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, Item};

/// The text with a number, or a list of numbers, set at a path such as `elements.cable.stiffness`.
///
/// # Errors
/// When the text is no model file, or there is no such place in it.
#[pyfunction]
pub fn patched(text: &str, path: &str, values: Vec<f64>, list: bool) -> PyResult<String> {
    let value = match (list, values.as_slice()) {
        (false, &[one]) => Value::Number(one),
        _ => Value::Numbers(values),
    };
    patch(text, &[Edit::Set { path: path.to_string(), value, comment: None }]).map_err(|e| PyValueError::new_err(e.to_string()))
}

/// The numbers at a path, and checks the model by the way; `folder` is where files are looked for that it names. Without a path no numbers.
///
/// # Errors
/// What is wrong with the model, with file, line and key; or that there is no such path.
#[pyfunction]
pub fn value_at(text: &str, name: &str, folder: Option<PathBuf>, path: Option<&str>) -> PyResult<Vec<f64>> {
    let model = Model::from_toml_in(text, name, folder.as_deref()).map_err(|e| PyValueError::new_err(e.to_string()))?;
    path.map_or(Ok(Vec::new()), |path| model.values_at(path).map_err(|e| PyValueError::new_err(format!("{name}: {path}: {e}"))))
}

/// The text without some of its tables, such as `inputs`.
///
/// # Errors
/// When the text is not TOML.
#[pyfunction]
pub fn without(text: &str, tables: Vec<String>) -> PyResult<String> {
    let mut document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| PyValueError::new_err(e.to_string()))?;
    for table in &tables {
        document.remove(table);
    }
    Ok(document.to_string())
}

/// The text with the files that it names by their whole paths, so that it may stand in any folder.
///
/// # Errors
/// When the text is not TOML.
#[pyfunction]
pub fn anywhere(text: &str, folder: PathBuf) -> PyResult<String> {
    let mut document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| PyValueError::new_err(e.to_string()))?;
    let folder = folder.canonicalize().unwrap_or(folder);
    for (_, item) in document.iter_mut() {
        resolve(item, &folder);
    }
    Ok(document.to_string())
}

/// Keys of a model file that name other files.
const FILES: [&str; 3] = ["file", "network", "curves"];

fn resolve(item: &mut Item, folder: &Path) {
    if let Some(tables) = item.as_array_of_tables_mut() {
        tables.iter_mut().flat_map(|table| table.iter_mut()).for_each(|(key, item)| one(&key, item, folder));
    } else if let Some(table) = item.as_table_like_mut() {
        table.iter_mut().for_each(|(key, item)| one(&key, item, folder));
    }
}

fn one(key: &str, item: &mut Item, folder: &Path) {
    match item.as_str().filter(|_| FILES.contains(&key)).map(|file| folder.join(file)) {
        Some(path) if path.is_file() => *item = toml_edit::value(path.display().to_string()),
        _ => resolve(item, folder),
    }
}
