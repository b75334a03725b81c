//! A node of the file, and what its kind needs.

use super::device::{NodeReader, axis_names};
use crate::graph::controller;
use crate::graph::coupling;
use crate::graph::hosts::read_host;
use crate::graph::overrides::absolute;
use crate::graph::{DeviceFiles, Direction, Hand, Node, NodeKind, ObserverFiles, Settings, bench};
use backdrive_control::changing_grip::GripChange;
use backdrive_control::hand::HandSettings;
use backdrive_control::observer::{Quantity, Weights};
use backdrive_control::rig::RigSettings;
use backdrive_control::speed_control::SpeedControl;
use backdrive_msgs::MAX_AXES;
use backdrive_plant::elements::Range;
use backdrive_plant::tomlfile::{FileError, Table};
use backdrive_signal::butterworth::MOST_ORDER;
use std::path::Path;

impl NodeReader<'_> {
    pub(super) fn read(&mut self, mut table: Table) -> Result<(), FileError> {
        let line = table.line();
        let name = table.need_string("name")?;
        table.label(&name);
        let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if !name.chars().all(allowed) || name.starts_with(|c: char| c.is_ascii_digit()) {
            return Err(table.error_at("name", "must be letters, digits and _, not beginning with a digit: it becomes part of topic names"));
        }
        if self.graph.nodes.iter().any(|n| n.name == name) {
            return Err(table.error_at("name", "another node has this name"));
        }
        let kind = table.need_one_of("kind", NodeKind::ALL)?;
        let command = table.string_or_strings("command")?;
        let host = read_host(&mut table, kind, &self.graph.hosts)?;
        let restart = table.boolean("restart")?.unwrap_or(false);
        let topics = match table.table("topics")? {
            None => Vec::new(),
            Some(topics) => read_topics(topics, kind)?,
        };
        let device = self.real_device(&mut table, kind)?;
        if let (Some(_), Some(_)) = (&device, &command) {
            return Err(table.error_at("device", "a program of your own (command) has its own device; omit one of both"));
        }
        let (settings, axis_names) = match &device {
            Some(device) => self.with_device(&mut table, kind, device)?,
            None => self.settings(&mut table, kind, command.is_some())?,
        };
        table.finish()?;
        let node = Node { name, kind, command, host, restart, axes: axis_names.len(), axis_names, topics, device, settings, line };
        self.graph.nodes.push(node);
        Ok(())
    }

    fn settings(&mut self, table: &mut Table, kind: NodeKind, own: bool) -> Result<(Settings, Vec<String>), FileError> {
        Ok(match kind {
            NodeKind::Master | NodeKind::Slave if own && !table.contains("model") => {
                let names = own_axes(table)?;
                let device = DeviceFiles { model: None, fragment: None, substeps: None, real_sensors: true, grip_changes: Vec::new() };
                (if kind == NodeKind::Master { Settings::Master(device) } else { Settings::Slave(device) }, names)
            }
            NodeKind::Operator => {
                let intents = self.intents(table)?;
                let names = (0..intents.len()).map(|i| format!("axis{i}")).collect();
                (Settings::Operator(intents), names)
            }
            NodeKind::Master => {
                let mut device = self.device(table, Some("grip"), false)?;
                device.grip_changes = grip_changes(table)?;
                let names = axis_names(&device);
                (Settings::Master(device), names)
            }
            NodeKind::Slave => self.slave(table)?,
            NodeKind::Canceller => self.canceller(table)?,
            NodeKind::Scaling => {
                let guard = table.boolean("guard")?.unwrap_or(false);
                let dither = self.excitations(table, "dither")?;
                (Settings::Scaling { dither, guard }, Vec::new())
            }
            NodeKind::Coupling => {
                let (law, velocity_hz) = coupling::read(table)?;
                (Settings::Coupling { law, velocity_hz }, Vec::new())
            }
            NodeKind::Controller => self.controller(table)?,
            NodeKind::Exciter => self.exciter(table)?,
            NodeKind::Observer => {
                let observer = self.observer(table)?;
                let names = axis_names(&observer.device);
                (Settings::Observer(observer), names)
            }
            NodeKind::Cycle => {
                let (text, path) = self.named(table, "cycle")?;
                (Settings::Cycle(bench::cycle_from_csv(&text, &path)?), one_shaft())
            }
            NodeKind::SpeedControl => self.speed_control(table)?,
            NodeKind::Dynamometer => self.dynamometer(table)?,
            NodeKind::Engine => {
                let (text, path) = self.named(table, "map")?;
                (Settings::Engine(bench::EngineFile::from_toml(&text, &path)?), one_shaft())
            }
            NodeKind::Shaft => (Settings::Shaft(self.device(table, None, false)?), one_shaft()),
            NodeKind::Recorder => self.recorder(table)?,
            NodeKind::Rig => self.rig(table)?,
        })
    }

    /// A slave and what it touches.
    fn slave(&mut self, table: &mut Table) -> Result<(Settings, Vec<String>), FileError> {
        let mut device = self.device(table, Some("environment"), false)?;
        if let Some(grip) = device.fragment.as_ref().filter(|f| f.hand.is_some()) {
            let told = format!(
                "\"{}\" is a grip: it is fixed to a `hand`, which only an operator moves; name what the slave touches (plant/environments), \
                 or give the grip to the master (`grip`, --grip)",
                grip.network.name
            );
            return Err(table.error_at("environment", told));
        }
        self.touched_elsewhere(table, &mut device)?;
        let names = axis_names(&device);
        Ok((Settings::Slave(device), names))
    }

    /// A model that predicts the induced motion.
    fn canceller(&mut self, table: &mut Table) -> Result<(Settings, Vec<String>), FileError> {
        let mut device = self.device(table, Some("grip"), true)?;
        device.real_sensors = false;
        let high_pass_hz = table.number_or("high_pass_hz", Range::NonNegative, 0.0)?;
        let names = axis_names(&device);
        let estimated = table.one_of("hand", &Hand::ALL)? == Some(Hand::Estimated);
        let range = table.numbers("hand_range", Range::Positive)?;
        let edge_without = table.number("edge_without", Range::Positive)?;
        let unused = range.as_ref().map(|_| "hand_range").or(edge_without.map(|_| "edge_without"));
        let hand = match (estimated, unused) {
            (false, None) => None,
            (false, Some(key)) => return Err(table.error_at(key, "has no effect without hand = \"estimated\"")),
            (true, _) => Some(HandSettings { edge_without, ..hand_settings(table, range.as_deref())? }),
        };
        if hand.is_some_and(|hand| hand.edge_without.is_none()) && names.len() > 1 {
            // Measured on launch/three-joint.toml: without a limit to its share the loop shook at gains at which nothing cancelled was stable.
            return Err(table.error_at(
                "hand",
                format!(
                    "\"estimated\" over {} coupled axes needs edge_without (--edge-without MU_LAMBDA): without it the canceller can make \
                     a stable loop oscillate. It is the gain up to which this graph is stable with --canceller none; `backdrive \
                     stability` on a bag of such a run gives it. Or omit hand = \"estimated\" (--hand estimated)",
                    names.len()
                ),
            ));
        }
        Ok((Settings::Canceller(device, high_pass_hz, hand), names))
    }

    /// A slave's controller.
    fn controller(&mut self, table: &mut Table) -> Result<(Settings, Vec<String>), FileError> {
        let model = match table.contains("model") {
            true => self.device(table, None, true)?.model,
            false => None,
        };
        let law = controller::read(table, model.as_ref())?;
        Ok((Settings::Controller { law, model }, Vec::new()))
    }

    /// Forces that are played.
    fn exciter(&mut self, table: &mut Table) -> Result<(Settings, Vec<String>), FileError> {
        let forces = self.excitations(table, "force")?;
        if forces.is_empty() {
            return Err(table.missing("force"));
        }
        let names = (0..forces.len()).map(|i| format!("axis{i}")).collect();
        Ok((Settings::Exciter(forces), names))
    }

    /// The speed control of a test bench.
    fn speed_control(&mut self, table: &mut Table) -> Result<(Settings, Vec<String>), FileError> {
        let mut gain = |key: &str, range: Range| table.need_number(key, range);
        let (proportional, integral) = (gain("proportional", Range::NonNegative)?, gain("integral", Range::NonNegative)?);
        Ok((Settings::SpeedControl(SpeedControl::new(proportional, integral, gain("limit", Range::Positive)?)), one_shaft()))
    }

    /// A dynamometer by its map.
    fn dynamometer(&mut self, table: &mut Table) -> Result<(Settings, Vec<String>), FileError> {
        let (text, path) = self.named(table, "map")?;
        let (model, noise) = bench::dynamometer_from_toml(&text, &path)?;
        Ok((Settings::Dynamometer(model, noise), one_shaft()))
    }

    /// A recorder and its bag.
    fn recorder(&mut self, table: &mut Table) -> Result<(Settings, Vec<String>), FileError> {
        let stem = self.graph.path.file_stem().map_or("run".into(), |s| s.to_string_lossy().to_string());
        let bag = table.string("bag")?.unwrap_or_else(|| format!("{stem}.mcap"));
        let here = std::env::current_dir().unwrap_or_default();
        self.graph.bag = Some(absolute(&here, Path::new(&bag)));
        Ok((Settings::Recorder, Vec::new()))
    }

    /// A ram with its specimen.
    fn rig(&mut self, table: &mut Table) -> Result<(Settings, Vec<String>), FileError> {
        let device = self.device(table, Some("specimen"), false)?;
        let demand = self.excitations(table, "demand")?;
        let settings = rig_settings(table)?;
        let names = axis_names(&device);
        if demand.is_empty() {
            return Err(table.missing("demand"));
        }
        Ok((Settings::Rig(device, settings, demand), names))
    }

    /// `model`, what is measured of it, its noise, and how the gains are chosen.
    fn observer(&mut self, table: &mut Table) -> Result<ObserverFiles, FileError> {
        let device = self.device(table, None, false)?;
        let choices = [("position", Quantity::Position), ("velocity", Quantity::Velocity)];
        let measured = table.one_of("quantity", &choices)?.unwrap_or(Quantity::Position);
        let user = table.one_of("user_quantity", &choices)?.unwrap_or(measured);
        let noise = table.numbers("noise", Range::Positive)?.ok_or_else(|| table.missing("noise"))?;
        let force_rate = table.number_or("force_rate", Range::Positive, 1.0)?;
        let back_off = table.number_or("back_off", Range::Positive, 2.0)?;
        if back_off <= 1.0 {
            return Err(table.error_at("back_off", format!("must be above 1, is {back_off}: at the least m itself the gains are infinite")));
        }
        let amplitude = table.number_or("amplitude", Range::Positive, 1e-3)?;
        let order = table.integer("filter_order", 1, MOST_ORDER as i64)?.unwrap_or(2) as usize;
        let filter = (order, table.number_or("filter_hz", Range::NonNegative, 0.0)?);
        let weights = Weights { rate: force_rate.powi(-2), ..Weights::default() };
        Ok(ObserverFiles { device, quantities: [measured, user], noise, weights, back_off, amplitude, filter })
    }
}

/// Names of the axes of a device that only the user's own program knows.
fn own_axes(table: &mut Table) -> Result<Vec<String>, FileError> {
    let names = table
        .strings("axes")?
        .ok_or_else(|| table.error("needs a model, or axes = [\"...\"]: the names of the axes of your program's device"))?;
    if names.is_empty() || names.len() > MAX_AXES {
        return Err(table.error_at("axes", format!("expected 1 to {MAX_AXES} names, found {}", names.len())));
    }
    Ok(names)
}

/// A test bench has one axis.
fn one_shaft() -> Vec<String> {
    vec!["shaft".to_string()]
}

/// `grip_changes = [{ t, scale }, ..]`: from when on a hand grips by which factor on the grip of the file.
fn grip_changes(table: &mut Table) -> Result<Vec<GripChange>, FileError> {
    let mut changes: Vec<GripChange> = Vec::new();
    for mut change in table.tables("grip_changes")? {
        let (at_s, scale) = (change.need_number("t", Range::NonNegative)?, change.need_number("scale", Range::Positive)?);
        if changes.last().is_some_and(|last| at_s <= last.at_s) {
            return Err(change.error_at("t", "times must increase"));
        }
        change.finish()?;
        changes.push(GripChange { at_s, scale });
    }
    Ok(changes)
}

/// Between which factors on the grip of its file a hand is looked for.
fn hand_settings(table: &Table, range: Option<&[f64]>) -> Result<HandSettings, FileError> {
    match range {
        None => Ok(HandSettings::default()),
        Some([softest, firmest]) if softest < firmest => Ok(HandSettings { softest: *softest, firmest: *firmest, edge_without: None }),
        Some(_) => Err(table.error_at("hand_range", "expected two factors on the grip of the file, the softer first, such as [0.5, 2.0]")),
    }
}

/// The displacement controller of a rig, and its sensors.
fn rig_settings(table: &mut Table) -> Result<RigSettings, FileError> {
    Ok(RigSettings {
        proportional: table.need_number("proportional", Range::Positive)?,
        integral: table.number_or("integral", Range::NonNegative, 0.0)?,
        derivative: table.number_or("derivative", Range::NonNegative, 0.0)?,
        filter_hz: table.number_or("filter_hz", Range::Positive, f64::INFINITY)?,
        force_noise: table.number_or("force_noise", Range::NonNegative, 0.0)?,
    })
}

fn read_topics(mut table: Table, kind: NodeKind) -> Result<Vec<(String, String)>, FileError> {
    let mut topics = Vec::new();
    for port in kind.ports(Direction::Output) {
        if let Some(name) = table.string(port)? {
            let fine = name.starts_with('/') && name.len() > 1 && !name.ends_with('/') && !name.contains("//");
            if !fine || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '/') {
                return Err(table.error_at(port, "a topic is an absolute ROS name such as \"/master/measured_js\""));
            }
            topics.push((port.to_string(), name));
        }
    }
    table.finish()?;
    Ok(topics)
}
