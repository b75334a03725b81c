//! Model files: TOML text to [`Model`] and [`Fragment`], with every error at its line.

mod network;
mod paths;
mod points;
mod robot;
mod servo;
mod signals;

pub use network::{HAND, PORT};
pub use paths::{InputKey, NumberOf, OutputKey};

use crate::model::{Fragment, Model};
use crate::tomlfile::{FileError, Table};
use std::path::Path;

/// What a model file may hold.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelFile {
    /// A device.
    Device(Model),
    /// A grip or an environment, `kind = "fragment"`.
    Fragment(Fragment),
}

impl ModelFile {
    /// Reads a model file of either sort.
    pub fn load(path: &Path) -> Result<ModelFile, FileError> {
        read(Table::open(path)?, path.parent())
    }

    /// Reads model text of either sort; `name` stands for the file in errors.
    pub fn from_toml(text: &str, name: &str) -> Result<ModelFile, FileError> {
        read(Table::parse(text, name)?, None)
    }
}

impl Model {
    /// Reads a device's model file. Errors name file, line and key; a fragment is refused.
    pub fn load(path: &Path) -> Result<Model, FileError> {
        device(ModelFile::load(path)?, &path.display().to_string())
    }

    /// Reads a device's model from text; `name` stands for the file in errors.
    pub fn from_toml(text: &str, name: &str) -> Result<Model, FileError> {
        device(ModelFile::from_toml(text, name)?, name)
    }

    /// Reads a device's model from the text of a file that stands in `folder`, which files that the model names are looked for in; `name` stands for the
    /// file in errors.
    pub fn from_toml_in(text: &str, name: &str, folder: Option<&Path>) -> Result<Model, FileError> {
        device(read(Table::parse(text, name)?, folder)?, name)
    }
}

impl Fragment {
    /// Reads a grip or an environment. Errors name file, line and key; a device is refused.
    pub fn load(path: &Path) -> Result<Fragment, FileError> {
        network::only_fragment(Table::open(path)?, path.parent())
    }

    /// Reads a fragment from text; `name` stands for the file in errors.
    pub fn from_toml(text: &str, name: &str) -> Result<Fragment, FileError> {
        network::only_fragment(Table::parse(text, name)?, None)
    }

    /// As [`Model::from_toml_in`].
    pub fn from_toml_in(text: &str, name: &str, folder: Option<&Path>) -> Result<Fragment, FileError> {
        network::only_fragment(Table::parse(text, name)?, folder)
    }
}

fn device(file: ModelFile, name: &str) -> Result<Model, FileError> {
    match file {
        ModelFile::Device(model) => Ok(model),
        ModelFile::Fragment(_) => Err(FileError::whole(name, "is a fragment (a grip or an environment), expected the model of a device")),
    }
}

fn read(mut top: Table, folder: Option<&Path>) -> Result<ModelFile, FileError> {
    let (mut model, motion, is_fragment) = network::read_head(&mut top)?;
    if is_fragment {
        return Ok(ModelFile::Fragment(network::read_fragment_file(top, model, motion, folder)?));
    }
    if let Some(mut table) = top.table("robot")? {
        robot::read_robot(&mut table, &mut model, folder)?;
        table.finish()?;
    }
    points::read_points(&mut top, &mut model)?;
    model.motion = motion.or(robot::motion(&model)).unwrap_or_default();
    let bodies = network::read_bodies(&mut top, false, &mut model)?;
    robot::read_joints(&mut top, &mut model, folder)?;
    network::read_what_acts(&mut top, bodies.as_ref(), false, &mut model, folder)?;
    for mut table in top.tables("axes")? {
        let axis = signals::read_axis(&mut table, &model)?;
        table.finish()?;
        model.axes.push(axis);
    }
    servo::read_servos(&mut top, &mut model)?;
    top.finish()?;
    Ok(ModelFile::Device(model))
}
