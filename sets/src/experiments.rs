//! What a graph's experiments record, and the set of recordings that they leave.

use crate::error::SetError;
use backdrive_bags::{Reader, Signal, signals};
use backdrive_control::shaft::{SENSORS, TORQUES};
use backdrive_nodes::graph::{DeviceFiles, Experiment, Graph, NodeKind, Settings};
use backdrive_plant::model::Model;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// What an experiment records: the device as held, its grip a part of the model, or the specimen of a rig, and the topic and field of each signal.
pub struct Device {
    model: Model,
    /// Signal, topic, field.
    columns: Vec<(String, String, String)>,
}

impl Device {
    /// Of a graph: the held master, the specimen of a rig, or the shaft of a test bench.
    ///
    /// # Errors
    /// It has none of them, or without a model.
    pub fn of(graph: &Graph) -> Result<Device, SetError> {
        if let Some(index) = graph.nodes.iter().position(|n| n.kind == NodeKind::Rig) {
            return Device::on_rig(graph, index);
        }
        let master = graph.nodes.iter().position(|n| n.kind == NodeKind::Master);
        let device = master.map(|index| (index, &graph.nodes[index].settings));
        let Some((index, Settings::Master(files))) = device else {
            if let Some(shaft) = Device::of_bench(graph) {
                return Ok(shaft);
            }
            return Err(SetError::new(format!(
                "{}: experiments need a master, a rig, or a test bench's shaft, to be recorded",
                graph.path.display()
            )));
        };
        let Some(model) = &files.model else {
            return Err(SetError::new(format!("{}: experiments need a master's model", graph.path.display())));
        };
        let (mut held, mut hands) = (model.clone(), model.own_hands());
        let mut columns = Vec::new();
        let topic = graph.topic_of(index, "measured").name;
        let intent = graph.nodes.iter().position(|n| n.kind == NodeKind::Operator);
        for (number, axis) in model.axes.iter().enumerate() {
            let (input, output) = (&model.inputs[axis.feedback].name, &model.outputs[axis.measured].name);
            columns.push((input.clone(), topic.clone(), format!("effort[{number}]")));
            columns.push((output.clone(), topic.clone(), format!("position[{number}]")));
        }
        if let Some(grip) = &files.fragment {
            let of_grip;
            (held, of_grip) = model.held_by(grip);
            hands.extend(of_grip);
        }
        if let Some(intent) = intent {
            let topic = graph.topic_of(intent, "intent").name;
            let of_hand = |(number, hand): (usize, usize)| (held.inputs[hand].name.clone(), topic.clone(), format!("position[{number}]"));
            columns.extend(hands.into_iter().map(of_hand));
        }
        // Only what is recorded can be compared.
        let recorded: Vec<usize> = model.axes.iter().map(|a| a.measured).collect();
        let renumber = |index: usize| (0..index).filter(|i| recorded.contains(i)).count();
        let mut number = 0;
        held.outputs.retain(|_| {
            number += 1;
            recorded.contains(&(number - 1))
        });
        held.axes.iter_mut().for_each(|a| a.measured = renumber(a.measured));
        Ok(Device { model: held, columns })
    }

    /// A test bench: its shaft, between the torques of its two machines.
    fn of_bench(graph: &Graph) -> Option<Device> {
        let shaft = graph.nodes.iter().position(|n| n.kind == NodeKind::Shaft)?;
        let Settings::Shaft(DeviceFiles { model: Some(model), .. }) = &graph.nodes[shaft].settings else { return None };
        let mut columns = Vec::new();
        for (name, port) in TORQUES.iter().zip(["engine", "dynamometer"]) {
            let feeding = graph.connections.iter().find(|c| c.to.0 == shaft && c.to.1 == port)?;
            columns.push((name.to_string(), feeding.topic.name.clone(), "effort[0]".to_string()));
        }
        for (name, (port, field)) in SENSORS.iter().zip([("engine", "velocity"), ("dynamometer", "velocity"), ("coupling", "effort")]) {
            columns.push((name.to_string(), graph.topic_of(shaft, port).name, format!("{field}[0]")));
        }
        let mut model = model.clone();
        model.outputs.retain(|o| SENSORS.contains(&o.name.as_str()));
        model.axes.clear();
        Some(Device { model, columns })
    }

    /// The specimen, moved as the ram moved and pushed with the force of the load cell.
    fn on_rig(graph: &Graph, index: usize) -> Result<Device, SetError> {
        let Settings::Rig(DeviceFiles { fragment: Some(specimen), .. }, ..) = &graph.nodes[index].settings else {
            return Err(SetError::new(format!("{}: experiments need a specimen on the rig", graph.path.display())));
        };
        if graph.nodes[index].axes != 1 {
            return Err(SetError::new(format!("{}: experiments need a rig of one axis", graph.path.display())));
        }
        let topic = graph.topic_of(index, "measured").name;
        let column = |signal: &str, field: &str| (signal.to_string(), topic.clone(), field.to_string());
        Ok(Device { model: specimen.driven(), columns: vec![column("displacement", "position[0]"), column("force", "effort[0]")] })
    }
}

/// An experiment that throws the device against its stops records the stops, which no model has.
///
/// # Errors
/// The bag cannot be read, or an axis went beyond its travel.
pub fn within_travel(bag: &Path, device: &Device) -> Result<(), SetError> {
    let reader = Reader::open(bag).map_err(SetError::new)?;
    for axis in &device.model.axes {
        let Some([low, high]) = axis.travel else { continue };
        let measured = &device.model.outputs[axis.measured].name;
        let Some((name, topic, field)) = device.columns.iter().find(|(signal, ..)| signal == measured) else { continue };
        let found = signals(&reader, &[Signal::new(name, topic, field)]).map_err(SetError::new)?;
        let beyond = |x: &f64| (low - x).max(x - high);
        let farthest = found.columns.iter().flatten().copied().max_by(|a, b| beyond(a).total_cmp(&beyond(b)));
        if let Some(x) = farthest.filter(|x| beyond(x) > 0.0) {
            let name = &axis.name;
            let message = format!("axis \"{name}\" went to {x:.4}, beyond its travel from {low} to {high}; weaken the excitation");
            return Err(SetError::new(message));
        }
    }
    Ok(())
}

/// A set of recordings in the making.
pub struct Set {
    /// Where its files go.
    pub folder: PathBuf,
    model: Model,
    columns: Vec<(String, String, String)>,
    /// Names of the recordings that are fitted.
    pub fit: Vec<String>,
    /// And of those that no fit sees.
    pub held_out: Vec<String>,
    /// Per file, the parameters that differ from the model there: path and value.
    conditions: Vec<(String, Vec<(String, f64)>)>,
}

impl Set {
    /// Of a device, in a folder.
    pub fn new(folder: PathBuf, device: &Device) -> Set {
        let (model, columns) = (device.model.clone(), device.columns.clone());
        Set { folder, model, columns, fit: Vec::new(), held_out: Vec::new(), conditions: Vec::new() }
    }

    /// Adds an experiment's recording. It must be of the set's device, in which single parameters may differ.
    ///
    /// # Errors
    /// More than single parameters differ.
    pub fn add(&mut self, experiment: &Experiment, device: &Device) -> Result<(), String> {
        let file = format!("{}.mcap", experiment.name);
        let conditions = differences(&self.model, &device.model).filter(|_| self.columns == device.columns);
        let conditions = conditions
            .ok_or("records a device with other bodies or elements than the experiments before it; put it into a separate step")?;
        if !conditions.is_empty() {
            self.conditions.push((file.clone(), conditions));
        }
        let list = if experiment.held_out { &mut self.held_out } else { &mut self.fit };
        list.push(file);
        Ok(())
    }

    /// The texts of its set file and of its model.
    pub fn texts(&self) -> [(&'static str, String); 2] {
        let quoted = |names: &[String]| names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ");
        let mut text = String::from("# Recordings of one device; no fit uses those under `held_out`.\n");
        let _ = writeln!(text, "model    = \"model.toml\"");
        let _ = writeln!(text, "fit      = [{}]", quoted(&self.fit));
        let _ = writeln!(text, "held_out = [{}]", quoted(&self.held_out));
        let _ = writeln!(text, "initial  = \"rest\"\n\n[columns]");
        for (name, topic, field) in &self.columns {
            let _ = writeln!(text, "\"{name}\" = {{ topic = \"{topic}\", field = \"{field}\" }}");
        }
        for (file, conditions) in &self.conditions {
            let list = conditions.iter().map(|(path, value)| format!("\"{path}\" = {value:?}")).collect::<Vec<_>>().join(", ");
            let _ = writeln!(text, "\n[files.\"{file}\"]\ncondition = {{ {list} }}");
        }
        [("set.toml", text), ("model.toml", self.model.to_toml())]
    }
}

/// Parameters of bodies and elements that `other` has instead of `model`'s; `None` where more than single parameters differ.
fn differences(model: &Model, other: &Model) -> Option<Vec<(String, f64)>> {
    let mut alike = model.clone();
    let mut found = Vec::new();
    for path in other.parameter_paths() {
        let (mine, theirs) = (model.values_at(&path).ok()?, other.values_at(&path).ok()?);
        if mine != theirs {
            let [value] = theirs.as_slice() else { return None };
            alike.set_values_at(&path, &theirs).ok()?;
            found.push((path, *value));
        }
    }
    (alike == *other).then_some(found)
}
