//! Keys that several kinds of nodes have: a simulated device, and the file that a key names.

use crate::graph::files::Sources;
use crate::graph::{DeviceFiles, Graph, Limits, NodeKind, RealDevice, Sensors, Settings};
use backdrive_devices::file::DeviceFile;
use backdrive_msgs::MAX_AXES;
use backdrive_plant::model::{Fragment, Model};
use backdrive_plant::tomlfile::{FileError, Table};
use std::path::{Path, PathBuf};

pub(super) struct NodeReader<'a> {
    pub(super) files: &'a Sources<'a>,
    pub(super) graph: &'a mut Graph,
}

/// Keys that say what a simulated device is held by or touches; a real one has a real hand, and real things around it.
const SIMULATED_ONLY: &[&str] =
    &["grip", "grip_changes", "environment", "environment_on", "substeps", "sensors", "limits", "keep", "lock", "grip_on"];

impl NodeReader<'_> {
    /// `device` and `emulator`: the real device of a master or slave.
    pub(super) fn real_device(&mut self, table: &mut Table, kind: NodeKind) -> Result<Option<RealDevice>, FileError> {
        if !table.contains("device") {
            return match table.contains("emulator") {
                true => Err(table.error_at("emulator", "has no effect without a device: add device = \"FILE.toml\", its file")),
                false => Ok(None),
            };
        }
        if !matches!(kind, NodeKind::Master | NodeKind::Slave) {
            return Err(table.error_at("device", "only a master or a slave has a device"));
        }
        let (text, path) = self.named(table, "device")?;
        let file = DeviceFile::parse(&text, &path)?;
        let emulator = table.string("emulator")?.map(PathBuf::from);
        Ok(Some(RealDevice { file, emulator, is_recorded: !self.files.files.are_on_disk() }))
    }

    /// Settings and axes of a node with a real device. A model that stands beside it is what is known of the device: others compute with it.
    pub(super) fn with_device(
        &mut self,
        table: &mut Table,
        kind: NodeKind,
        device: &RealDevice,
    ) -> Result<(Settings, Vec<String>), FileError> {
        let names = device.file.axis_names();
        let files = match table.contains("model") {
            true => {
                let files = self.device(table, Some(if kind == NodeKind::Master { "grip" } else { "environment" }), false)?;
                let axes = files.model.as_ref().map_or(0, |model| model.axes.len());
                if axes != names.len() {
                    let message = format!("has {axes} axes, and the device \"{}\" has {} joints", device.file.name, names.len());
                    return Err(table.error_at("model", message));
                }
                files
            }
            false => DeviceFiles { model: None, fragment: None, substeps: None, real_sensors: true, grip_changes: Vec::new() },
        };
        SIMULATED_ONLY.iter().for_each(|key| table.skip(key));
        Ok((if kind == NodeKind::Master { Settings::Master(files) } else { Settings::Slave(files) }, names))
    }
    /// `model`, its fragment, `substeps` and `sensors` of a simulated device.
    pub(super) fn device(&mut self, table: &mut Table, fragment_key: Option<&str>, may_be_none: bool) -> Result<DeviceFiles, FileError> {
        let model_path = table.need_string("model")?;
        let model = if may_be_none && model_path == "none" {
            None
        } else {
            Some(self.files.read_whole(Path::new(&model_path), &mut self.graph.files, Model::from_toml_in, Model::to_toml)?)
        };
        let model = model.map(|model| isolate(model, table)).transpose()?;
        if let Some(axes) = model.as_ref().map(|model| model.axes.len()).filter(|axes| *axes > MAX_AXES) {
            return Err(table.error_at("model", format!("\"{model_path}\" has {axes} axes; a message carries at most {MAX_AXES}")));
        }
        let fragment = match fragment_key.map(|key| table.string(key)).transpose()?.flatten() {
            Some(path) if path != "none" => {
                Some(self.files.read_whole(Path::new(&path), &mut self.graph.files, Fragment::from_toml_in, Fragment::to_toml)?)
            }
            _ => None,
        };
        let substeps = table.integer("substeps", 1, 1000)?.map(|n| n as usize);
        let ignored = table.one_of("limits", &Limits::ALL)? == Some(Limits::Ignored);
        let model = model.map(|mut model| {
            if ignored {
                for axis in &mut model.axes {
                    (axis.force, axis.force_rate, axis.speed, axis.travel) = (None, None, None, None);
                }
            }
            model
        });
        let real_sensors = table.one_of("sensors", &Sensors::ALL)? != Some(Sensors::Ideal);
        Ok(DeviceFiles { model, fragment, substeps, real_sensors, grip_changes: Vec::new() })
    }

    /// `environment_on`: what the device touches is attached at these bodies, once each, instead of the user's body of every axis.
    pub(super) fn touched_elsewhere(&self, table: &mut Table, device: &mut DeviceFiles) -> Result<(), FileError> {
        let Some(names) = table.string_or_strings("environment_on")? else { return Ok(()) };
        let Some(model) = &mut device.model else { return Ok(()) };
        if names.is_empty() {
            return Err(table.error_at("environment_on", "names no body"));
        }
        let bodies = names.iter().map(|name| model.body_named(name).map_err(|e| table.error_at("environment_on", e)));
        let bodies = bodies.collect::<Result<Vec<usize>, FileError>>()?;
        let Some(environment) = device.fragment.take() else { return Ok(()) };
        for body in bodies {
            let attached = model.attach(&environment, body, &environment.network.name);
            let touching = attached.port_first.iter().chain(&attached.port_second);
            model.axes.iter_mut().for_each(|axis| axis.touches.extend(touching.clone()));
        }
        Ok(())
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
