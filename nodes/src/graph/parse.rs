//! Reads a graph file and the files that it names.

use super::{
    Connection, DeviceFiles, Direction, Experiment, Graph, Node, NodeKind, ObserverFiles, Overrides, Settings, bench, check,
    hosts::{read_host, read_hosts},
    overrides::{absolute, experiment_text},
    recorded::Recorded,
};
use crate::stage::{Clock, Impairment, Timing};
use backdrive_control::butterworth::MOST_ORDER;
use backdrive_control::observer::{Quantity, Weights};
use backdrive_control::operator::Intent;
use backdrive_control::rig::RigSettings;
use backdrive_control::scaling::{GainChange, GainPlan};
use backdrive_control::speed_control::SpeedControl;
use backdrive_msgs::MAX_AXES;
use backdrive_plant::elements::Range;
use backdrive_plant::excitation::{Excitation, ExcitationError, Shape};
use backdrive_plant::model::{Fragment, Model};
use backdrive_plant::tomlfile::{FileError, Table, read_text, unknown};
use std::path::{Path, PathBuf};

/// Highest rate of a graph, Hz.
pub const MAX_RATE_HZ: f64 = 10_000.0;

/// Where the files that a graph names are read from: the disk, or a bag that holds them.
pub enum Files<'a> {
    /// The file system.
    Disk,
    /// (path as in the graph's text, text); what is not there is read from the disk.
    Bag(&'a [(String, String)]),
}

impl Files<'_> {
    /// Whether the bag holds a file of this name.
    pub(super) fn holds(&self, name: &str) -> bool {
        matches!(self, Files::Bag(files) if files.iter().any(|(file, _)| file == name))
    }

    fn read(&self, path: &Path, seen: &mut Vec<(String, String)>) -> Result<String, FileError> {
        let name = path.display().to_string();
        let held = match self {
            Files::Disk => None,
            Files::Bag(files) => files.iter().find(|(file, _)| *file == name).map(|(_, text)| text.clone()),
        };
        let text = match held {
            Some(text) => text,
            None => read_text(path)?,
        };
        if !seen.iter().any(|(file, _)| *file == name) {
            seen.push((name, text.clone()));
        }
        Ok(text)
    }
}

impl Graph {
    /// Reads a graph file, changes it as the command line asks, and checks it.
    pub fn load(path: &Path, changes: &Overrides) -> Result<Graph, FileError> {
        Graph::from_text(&read_text(path)?, path, changes, &Files::Disk)
    }

    /// One experiment of a graph file that has some: a graph of its own, in which the experiment's keys stand in
    /// place of the nodes' and the length of the run.
    pub fn load_experiment(path: &Path, changes: &Overrides, experiment: &str) -> Result<Graph, FileError> {
        let whole = read_text(path)?;
        let text = experiment_text(&whole, experiment);
        Graph::from_text(&text, path, changes, &Files::Disk).map_err(|e| in_experiment(e, &whole, path, experiment))
    }

    /// The same from text, such as a bag holds; `path` is where its relative paths start and what errors name.
    pub fn from_text(text: &str, path: &Path, changes: &Overrides, files: &Files) -> Result<Graph, FileError> {
        let text = changes.apply(text, path, files)?;
        let mut top = Table::parse(text.as_str(), path.display().to_string())?;
        let title = top.string("title")?.unwrap_or_default();
        let rate_hz = top.need_number("rate_hz", Range::Positive)?;
        if rate_hz > MAX_RATE_HZ {
            return Err(top.error_at("rate_hz", format!("must be at most {MAX_RATE_HZ}, is {rate_hz}")));
        }
        let clock = top.one_of("clock", &[("lockstep", Clock::Lockstep), ("realtime", Clock::Realtime)])?.unwrap_or_default();
        let steps = top.number("duration_s", Range::Positive)?.map(|s| (s * rate_hz).round().max(1.0) as u64);
        let seed = top.integer("seed", 0, i64::MAX)?.unwrap_or(1) as u64;
        let peer_timeout_s = top.number_or("peer_timeout_s", Range::Positive, 10.0)?;
        let gains = read_gains(&mut top)?;
        let stale_after_s = match top.table("safety")? {
            None => 0.02,
            Some(mut safety) => {
                let stale_after_s = safety.number_or("stale_after_s", Range::Positive, 0.02)?;
                safety.finish()?;
                stale_after_s
            }
        };
        let mut graph = Graph {
            title,
            text: text.clone(),
            path: path.to_path_buf(),
            timing: Timing { rate_hz, clock, steps, peer_timeout_s },
            seed,
            gains,
            stale_after_s,
            bag: None,
            overwrite: changes.overwrite,
            record_origin: top.boolean("record_origin")?.unwrap_or(false),
            hosts: read_hosts(&mut top)?,
            nodes: Vec::new(),
            connections: Vec::new(),
            files: Vec::new(),
            experiments: Vec::new(),
        };
        let mut reader = NodeReader { files, graph: &mut graph };
        for table in top.tables("nodes")? {
            reader.read(table)?;
        }
        for table in top.tables("experiments")? {
            let experiment = read_experiment(table, &graph)?;
            graph.experiments.push(experiment);
        }
        let mut connections = Vec::new();
        for table in top.tables("connections")? {
            connections.push(read_connection(table, &graph)?);
        }
        graph.connections = connections;
        for index in 0..graph.connections.len() {
            let (node, port) = graph.connections[index].from.clone();
            graph.connections[index].topic = graph.topic_of(node, &port);
        }
        settle_axes(&mut graph);
        check::check(&graph, &top)?;
        top.finish()?;
        Ok(graph)
    }
}

/// An error about a graph that an experiment was written into, at the experiment's line: the other lines are not the file's.
fn in_experiment(error: FileError, whole: &str, path: &Path, name: &str) -> FileError {
    let file = path.display().to_string();
    if error.path != file {
        return error;
    }
    let tables = Table::parse(whole, file.as_str()).and_then(|mut top| top.tables("experiments")).unwrap_or_default();
    for mut table in tables {
        if table.string("name").ok().flatten().as_deref() != Some(name) {
            continue;
        }
        // The key that it changes, where the error is about that one.
        let mut line = table.line();
        for node in table.keys().into_iter().filter(|node| error.key.contains(&format!("\"{node}\""))) {
            line = table.line_of(&node);
            if let Ok(Some(changes)) = table.table(&node) {
                line = changes.keys().iter().find(|key| error.key.ends_with(key.as_str())).map_or(line, |key| changes.line_of(key));
            }
        }
        return FileError { line: Some(line), key: format!("experiment \"{name}\": {}", error.key), ..error };
    }
    error
}

fn read_gains(top: &mut Table) -> Result<GainPlan, FileError> {
    let mut plan = GainPlan { mu: 1.0, lambda: 0.0, ramp_s: 0.05, changes: Vec::new() };
    let Some(mut gains) = top.table("gains")? else { return Ok(plan) };
    plan.mu = gains.number_or("mu", Range::NonNegative, 1.0)?;
    plan.lambda = gains.need_number("lambda", Range::NonNegative)?;
    for (key, scale) in [("mu", plan.mu), ("lambda", plan.lambda)] {
        possible(&gains, key, scale)?;
    }
    plan.ramp_s = gains.number_or("ramp_s", Range::NonNegative, 0.05)?;
    let (mut mu, mut lambda, mut last) = (plan.mu, plan.lambda, 0.0);
    for mut change in gains.tables("change")? {
        let at_s = change.need_number("at_s", Range::NonNegative)?;
        if at_s < last {
            return Err(change.error_at("at_s", "changes must stand in order of time"));
        }
        mu = change.number_or("mu", Range::NonNegative, mu)?;
        lambda = change.number_or("lambda", Range::NonNegative, lambda)?;
        possible(&change, "mu", mu)?;
        possible(&change, "lambda", lambda)?;
        last = at_s;
        change.finish()?;
        plan.changes.push(GainChange { at_s, mu, lambda });
    }
    gains.finish()?;
    Ok(plan)
}

/// Largest scale of position or force. From the weakest sensor to the strongest slave there are six decades: what is beyond is a slip of the
/// pen, and its numbers would leave all bounds in a few steps.
const LARGEST_SCALE: f64 = 1e6;

fn possible(table: &Table, key: &str, scale: f64) -> Result<(), FileError> {
    match scale <= LARGEST_SCALE {
        true => Ok(()),
        false => {
            Err(table.error_at(key, format!("is {scale:e}, and a scale between two devices is at most {LARGEST_SCALE:e}: check its units")))
        }
    }
}

struct NodeReader<'a> {
    files: &'a Files<'a>,
    graph: &'a mut Graph,
}

impl NodeReader<'_> {
    fn read(&mut self, mut table: Table) -> Result<(), FileError> {
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
        let (settings, axis_names) = self.settings(&mut table, kind, command.is_some())?;
        table.finish()?;
        let node = Node { name, kind, command, host, restart, axes: axis_names.len(), axis_names, topics, settings, line };
        self.graph.nodes.push(node);
        Ok(())
    }

    fn settings(&mut self, table: &mut Table, kind: NodeKind, own: bool) -> Result<(Settings, Vec<String>), FileError> {
        Ok(match kind {
            NodeKind::Master | NodeKind::Slave if own && !table.contains("model") => {
                let names = own_axes(table)?;
                let device = DeviceFiles { model: None, fragment: None, substeps: None, real_sensors: true };
                (if kind == NodeKind::Master { Settings::Master(device) } else { Settings::Slave(device) }, names)
            }
            NodeKind::Operator => {
                let intents = self.intents(table)?;
                let names = (0..intents.len()).map(|i| format!("axis{i}")).collect();
                (Settings::Operator(intents), names)
            }
            NodeKind::Master => {
                let device = self.device(table, Some("grip"), false)?;
                let names = axis_names(&device);
                (Settings::Master(device), names)
            }
            NodeKind::Slave => {
                let device = self.device(table, Some("environment"), false)?;
                if let Some(grip) = device.fragment.as_ref().filter(|f| f.hand.is_some()) {
                    let told = format!(
                        "\"{}\" is a grip: it is fixed to a `hand`, which only an operator moves; name what the slave touches (plant/environments), \
                         or give the grip to the master (`grip`, --grip)",
                        grip.network.name
                    );
                    return Err(table.error_at("environment", told));
                }
                let names = axis_names(&device);
                (Settings::Slave(device), names)
            }
            NodeKind::Canceller => {
                let mut device = self.device(table, Some("grip"), true)?;
                device.real_sensors = false;
                let high_pass_hz = table.number_or("high_pass_hz", Range::NonNegative, 0.0)?;
                let names = axis_names(&device);
                (Settings::Canceller(device, high_pass_hz), names)
            }
            NodeKind::Scaling => {
                let guard = table.boolean("guard")?.unwrap_or(false);
                let dither = self.excitations(table, "dither")?;
                (Settings::Scaling { dither, guard }, Vec::new())
            }
            NodeKind::Controller => {
                let model = match table.contains("model") {
                    true => self.device(table, None, true)?.model,
                    false => None,
                };
                let law = super::controller::read(table, model.as_ref())?;
                (Settings::Controller { law, model }, Vec::new())
            }
            NodeKind::Exciter => {
                let forces = self.excitations(table, "force")?;
                if forces.is_empty() {
                    return Err(table.missing("force"));
                }
                let names = (0..forces.len()).map(|i| format!("axis{i}")).collect();
                (Settings::Exciter(forces), names)
            }
            NodeKind::Observer => {
                let observer = self.observer(table)?;
                let names = axis_names(&observer.device);
                (Settings::Observer(observer), names)
            }
            NodeKind::Cycle => {
                let (text, path) = self.named(table, "cycle")?;
                (Settings::Cycle(bench::cycle_from_csv(&text, &path)?), one_shaft())
            }
            NodeKind::SpeedControl => {
                let mut gain = |key: &str, range: Range| table.need_number(key, range);
                let (proportional, integral) = (gain("proportional", Range::NonNegative)?, gain("integral", Range::NonNegative)?);
                (Settings::SpeedControl(SpeedControl::new(proportional, integral, gain("limit", Range::Positive)?)), one_shaft())
            }
            NodeKind::Dynamometer => {
                let (text, path) = self.named(table, "map")?;
                let (model, noise) = bench::dynamometer_from_toml(&text, &path)?;
                (Settings::Dynamometer(model, noise), one_shaft())
            }
            NodeKind::Engine => {
                let (text, path) = self.named(table, "map")?;
                (Settings::Engine(bench::EngineFile::from_toml(&text, &path)?), one_shaft())
            }
            NodeKind::Shaft => (Settings::Shaft(self.device(table, None, false)?), one_shaft()),
            NodeKind::Recorder => {
                let stem = self.graph.path.file_stem().map_or("run".into(), |s| s.to_string_lossy().to_string());
                let bag = table.string("bag")?.unwrap_or_else(|| format!("{stem}.mcap"));
                let here = std::env::current_dir().unwrap_or_default();
                self.graph.bag = Some(absolute(&here, Path::new(&bag)));
                (Settings::Recorder, Vec::new())
            }
            NodeKind::Rig => {
                let device = self.device(table, Some("specimen"), false)?;
                let demand = self.excitations(table, "demand")?;
                let settings = rig_settings(table)?;
                let names = axis_names(&device);
                if demand.is_empty() {
                    return Err(table.missing("demand"));
                }
                (Settings::Rig(device, settings, demand), names)
            }
        })
    }

    /// `model`, its fragment, `substeps` and `sensors` of a simulated device.
    fn device(&mut self, table: &mut Table, fragment_key: Option<&str>, may_be_none: bool) -> Result<DeviceFiles, FileError> {
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
        Ok(DeviceFiles { model, fragment, substeps, real_sensors })
    }

    /// The text of the file that a key names, and its path.
    fn named(&mut self, table: &mut Table, key: &str) -> Result<(String, String), FileError> {
        let path = table.need_string(key)?;
        Ok((self.files.read(Path::new(&path), &mut self.graph.files)?, path))
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

    fn intents(&mut self, table: &mut Table) -> Result<Vec<Intent>, FileError> {
        let axes = table.tables("axes")?;
        if axes.is_empty() {
            return Ok(vec![self.intent(table)?]);
        }
        if axes.len() > MAX_AXES {
            return Err(table.error_at("axes", format!("at most {MAX_AXES} axes are possible")));
        }
        axes.into_iter()
            .map(|mut axis| {
                let intent = self.intent(&mut axis)?;
                axis.finish()?;
                Ok(intent)
            })
            .collect()
    }

    /// One axis: `waypoints = [{ t, x }, ..]`, or `sine = { amplitude, frequency }`, or nothing.
    fn intent(&mut self, table: &mut Table) -> Result<Intent, FileError> {
        let mut points: Vec<[f64; 2]> = Vec::new();
        for mut point in table.tables("waypoints")? {
            let (t, x) = (point.need_number("t", Range::NonNegative)?, point.need_number("x", Range::Any)?);
            if points.last().is_some_and(|last| t <= last[0]) {
                return Err(point.error_at("t", "times must increase"));
            }
            point.finish()?;
            points.push([t, x]);
        }
        if !points.is_empty() {
            return Ok(Intent::Waypoints(points));
        }
        if let Some(mut sine) = table.table("sine")? {
            let amplitude = sine.need_number("amplitude", Range::Any)?;
            let frequency = sine.need_number("frequency", Range::Positive)?;
            sine.finish()?;
            return Ok(Intent::Sine { amplitude, frequency });
        }
        Ok(Intent::Rest)
    }

    /// A string or a list of strings, an excitation or a recorded force per axis, as samples at the graph's rate.
    /// One multisine for a master of several axes (read before): each axis gets phases of its own, for what two axes do
    /// together cannot be told apart.
    fn for_each_axis(&self, excitation: &Excitation) -> Vec<Excitation> {
        let axes = self.graph.nodes.iter().find(|n| n.kind == NodeKind::Master).map_or(1, |n| n.axes);
        let own = |axis: usize| {
            let mut own = excitation.clone();
            if let Shape::Multisine { seed, .. } = &mut own.shape {
                *seed = seed.wrapping_add(axis as u64);
            }
            own
        };
        (0..axes.max(1)).map(own).collect()
    }

    fn excitations(&mut self, table: &mut Table, key: &str) -> Result<Vec<Vec<f64>>, FileError> {
        let Some(specs) = table.string_or_strings(key)? else { return Ok(Vec::new()) };
        if specs.len() > MAX_AXES {
            return Err(table.error_at(key, format!("at most {MAX_AXES} axes are possible")));
        }
        let one = specs.first().filter(|_| specs.len() == 1 && key == "dither").and_then(|spec| spec.parse::<Excitation>().ok());
        if let Some(one) = one.filter(|e| matches!(e.shape, Shape::Multisine { .. })) {
            let samples = |e: &Excitation| e.samples(self.graph.timing.rate_hz).map_err(|e| table.error_at(key, e.to_string()));
            return self.for_each_axis(&one).iter().map(samples).collect();
        }
        specs
            .iter()
            .map(|spec| {
                if let Some(recorded) = Recorded::parse(spec) {
                    let recorded = recorded.map_err(|e| table.error_at(key, e))?;
                    let text = self.files.read(Path::new(&recorded.file), &mut self.graph.files)?;
                    return recorded.samples(&text, self.graph.timing.rate_hz).map_err(|e| table.error_at(key, e));
                }
                let excitation: Excitation = spec.parse().map_err(|e: ExcitationError| table.error_at(key, e.to_string()))?;
                excitation.samples(self.graph.timing.rate_hz).map_err(|e| table.error_at(key, e.to_string()))
            })
            .collect()
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

fn axis_names(device: &DeviceFiles) -> Vec<String> {
    device.model.as_ref().map_or(Vec::new(), |model| model.axes.iter().map(|a| a.name.clone()).collect())
}

fn read_experiment(mut table: Table, graph: &Graph) -> Result<Experiment, FileError> {
    let name = table.need_string("name")?;
    table.label(&name);
    if !name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c)) {
        return Err(table.error_at("name", "must be letters, digits, - and _: it becomes a file name"));
    }
    if graph.experiments.iter().any(|e| e.name == name) {
        return Err(table.error_at("name", "another experiment has this name"));
    }
    let held_out = table.boolean("held_out")?.unwrap_or(false);
    table.number("duration_s", Range::Positive)?;
    let step = table.string("step")?;
    // What it changes in a node is checked when it is made into a graph of its own.
    for key in table.keys() {
        if graph.node(&key).is_none() {
            let nodes = graph.nodes.iter().map(|n| n.name.as_str());
            let known = nodes.chain(["name", "held_out", "duration_s", "step"]);
            return Err(table.error_at(&key, unknown("key", &key, known.collect::<Vec<_>>())));
        }
        table.skip(&key);
    }
    let line = table.line();
    table.finish()?;
    Ok(Experiment { name, held_out, step, line })
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

fn read_connection(mut table: Table, graph: &Graph) -> Result<Connection, FileError> {
    let from = read_end(&mut table, "from", Direction::Output, graph)?;
    let to = read_end(&mut table, "to", Direction::Input, graph)?;
    let delay = table.integer("delay", 0, 100_000)?.unwrap_or(0) as u64;
    let impairment = match table.table("impair")? {
        None => None,
        Some(mut impair) => {
            let impairment = Impairment {
                delay_s: impair.number_or("delay_s", Range::Between(0.0, 10.0), 0.0)?,
                jitter_s: impair.number_or("jitter_s", Range::Between(0.0, 10.0), 0.0)?,
                loss: impair.number_or("loss", Range::Between(0.0, 1.0), 0.0)?,
                seed: impair.integer("seed", 0, i64::MAX)?.map_or(graph.seed, |s| s as u64),
            };
            impair.finish()?;
            Some(impairment)
        }
    };
    let line = table.line();
    table.finish()?;
    let topic = graph.topic_of(from.0, &from.1);
    Ok(Connection { from, to, topic, delay, impairment, line })
}

fn read_end(table: &mut Table, key: &str, direction: Direction, graph: &Graph) -> Result<(usize, String), FileError> {
    let text = table.need_string(key)?;
    let Some((node, port)) = text.split_once('.') else {
        return Err(table.error_at(key, format!("expected \"node.port\", found \"{text}\"")));
    };
    let Some(index) = graph.nodes.iter().position(|n| n.name == node) else {
        let message = unknown("node", node, graph.nodes.iter().map(|n| n.name.as_str()));
        return Err(table.error_at(key, message));
    };
    let kind = graph.nodes[index].kind;
    if kind.port(port, direction).is_none() {
        let what = if direction == Direction::Input { "input port" } else { "output port" };
        let message = unknown(what, port, kind.ports(direction).iter().copied());
        return Err(table.error_at(key, format!("node \"{node}\" ({}): {message}", kind.name())));
    }
    Ok((index, port.to_string()))
}

/// A node without axes of its own (scaling, a canceller without a model, a short script) has those of what it is connected to.
fn settle_axes(graph: &mut Graph) {
    let master = graph.nodes.iter().find(|n| n.kind == NodeKind::Master).map(|n| n.axis_names.clone());
    let slave = graph.nodes.iter().find(|n| n.kind == NodeKind::Slave).map(|n| n.axis_names.clone());
    let Some(names) = master.or(slave) else { return };
    for node in &mut graph.nodes {
        let follows = matches!(node.kind, NodeKind::Scaling | NodeKind::Operator | NodeKind::Exciter) || node.axes == 0;
        if follows && node.kind != NodeKind::Recorder && node.axes <= names.len() {
            node.axis_names.clone_from(&names);
            node.axes = names.len();
        }
    }
}

impl Graph {
    /// Where the run's files are named relative to.
    pub fn folder(&self) -> PathBuf {
        self.path.parent().map(Path::to_path_buf).unwrap_or_default()
    }
}
