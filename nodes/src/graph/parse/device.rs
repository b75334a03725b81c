//! Keys that several kinds of nodes have: a simulated device, and the file that a key names.

use crate::graph::files::Files;
use crate::graph::{DeviceFiles, Graph};
use backdrive_plant::model::{Fragment, Model};
use backdrive_plant::tomlfile::{FileError, Table};
use std::path::Path;

pub(super) struct NodeReader<'a> {
    pub(super) files: &'a Files<'a>,
    pub(super) graph: &'a mut Graph,
}

impl NodeReader<'_> {
    /// `model`, its fragment, `substeps` and `sensors` of a simulated device.
    pub(super) fn device(&mut self, table: &mut Table, fragment_key: Option<&str>, may_be_none: bool) -> Result<DeviceFiles, FileError> {
        let model_path = table.need_string("model")?;
        let model = if may_be_none && model_path == "none" {
            None
        } else {
            let text = self.files.read(Path::new(&model_path), &mut self.graph.files)?;
            Some(Model::from_toml(&text, &model_path)?)
        };
        let model = model.map(|model| isolate(model, table)).transpose()?;
        let fragment = match fragment_key.map(|key| table.string(key)).transpose()?.flatten() {
            Some(path) if path != "none" => {
                let text = self.files.read(Path::new(&path), &mut self.graph.files)?;
                Some(Fragment::from_toml(&text, &path)?)
            }
            _ => None,
        };
        let substeps = table.integer("substeps", 1, 1000)?.map(|n| n as usize);
        let enforced = table.one_of("limits", &[("enforced", true), ("ignored", false)])?.unwrap_or(true);
        let model = model.map(|mut model| {
            if !enforced {
                for axis in &mut model.axes {
                    (axis.force, axis.force_rate, axis.speed, axis.travel) = (None, None, None, None);
                }
            }
            model
        });
        let real_sensors = table.one_of("sensors", &[("as_modelled", true), ("ideal", false)])?.unwrap_or(true);
        Ok(DeviceFiles { model, fragment, substeps, real_sensors, grip_changes: Vec::new() })
    }

    /// The text of the file that a key names, and its path.
    pub(super) fn named(&mut self, table: &mut Table, key: &str) -> Result<(String, String), FileError> {
        let path = table.need_string(key)?;
        Ok((self.files.read(Path::new(&path), &mut self.graph.files)?, path))
    }
}

/// `keep`, `lock` and `grip_on`: a sub-chain of the device, for identification by successive isolation.
fn isolate(mut model: Model, table: &mut Table) -> Result<Model, FileError> {
    if let Some(names) = table.strings("keep")? {
        model.keep(&names).map_err(|e| table.error_at("keep", e))?;
    }
    if let Some(names) = table.strings("lock")? {
        model.lock(&names).map_err(|e| table.error_at("lock", e))?;
    }
    if let Some(name) = table.string("grip_on")? {
        let body = model.body_named(&name).map_err(|e| table.error_at("grip_on", e))?;
        model.axes.iter_mut().for_each(|axis| axis.user = body);
    }
    Ok(model)
}

pub(super) fn axis_names(device: &DeviceFiles) -> Vec<String> {
    device.model.as_ref().map_or(Vec::new(), |model| model.axes.iter().map(|a| a.name.clone()).collect())
}
