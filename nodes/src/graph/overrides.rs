//! What the command line changes in a graph file, without touching the file.

use super::choices::{Hand, Limits, Sensors};
use super::files::Files;
use super::recorded::Recorded;
use super::swap::put_coupling;
use super::{Graph, NodeKind};
use crate::stage::Clock;
use backdrive_control::coupling::LawKind;
use backdrive_plant::tomlfile::FileError;
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, Item, Value, value};

/// Changes to a graph; `None` keeps the file's value. Files are relative to the working directory.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Overrides {
    /// Model of the master.
    pub master: Option<PathBuf>,
    /// Grip on the master; `none` for no hand.
    pub grip: Option<PathBuf>,
    /// Model of the slave.
    pub slave: Option<PathBuf>,
    /// What the slave touches; `none` for nothing.
    pub environment: Option<PathBuf>,
    /// The canceller's model; `none` for none, `master` for the model and the grip of the graph's master.
    pub canceller: Option<PathBuf>,
    /// The grip that the canceller assumes; `none` for none, `master` for the grip of the graph's master.
    pub canceller_grip: Option<PathBuf>,
    /// Corner of the canceller's high-pass, Hz.
    pub high_pass_hz: Option<f64>,
    /// Whether the canceller uses the hand of its grip file or estimates it.
    pub hand: Option<Hand>,
    /// Of a canceller that estimates the hand: the lowest gain product at which the loop oscillates without a canceller.
    pub edge_without: Option<f64>,
    /// Position scale.
    pub mu: Option<f64>,
    /// Force scale.
    pub lambda: Option<f64>,
    /// Law of the coupling; where the graph has a scaling node, a coupling takes its place.
    pub coupling: Option<LawKind>,
    /// Dither on the force channel, such as `multisine:peak=0.1,from=1,to=500,period=2`.
    pub dither: Option<String>,
    /// Whether the guard watches.
    pub guard: Option<bool>,
    /// The bag.
    pub bag: Option<PathBuf>,
    /// Whether a bag that exists may be replaced; stands in no text, for it is about this run alone.
    pub overwrite: bool,
    /// How time passes.
    pub clock: Option<Clock>,
    /// Steps per second.
    pub rate_hz: Option<f64>,
    /// Length of the run, s.
    pub duration_s: Option<f64>,
    /// Whether the bag records the machine and the folders that it was made from.
    pub record_origin: bool,
    /// Whether nodes wait by looking all the time.
    pub poll: bool,
    /// Seed of everything random.
    pub seed: Option<u64>,
    /// Whether sensors round and are noisy as the model files say.
    pub sensors: Option<Sensors>,
    /// Whether the devices' limits act.
    pub limits: Option<Limits>,
}

/// Keys of node tables that name files.
const FILE_KEYS: &[&str] = &["model", "grip", "environment", "recording", "map", "cycle", "specimen", "device", "emulator"];

impl Overrides {
    /// Names of the files that the changes put into the graph.
    pub(super) fn chosen_files(&self) -> Vec<String> {
        let here = std::env::current_dir().unwrap_or_default();
        let files = [&self.master, &self.grip, &self.slave, &self.environment, &self.canceller, &self.canceller_grip];
        let played = self.dither.as_deref().and_then(Recorded::parse).and_then(Result::ok).map(|recorded| recorded.file);
        files.into_iter().flatten().map(|path| absolute(&here, path).display().to_string()).chain(played).collect()
    }

    /// Text of the graph file with the changes, and with every file it names as an absolute path, but for those of a bag, which holds them by the
    /// name that stands there.
    pub(super) fn apply(&self, text: &str, path: &Path, files: &Files) -> Result<String, FileError> {
        let name = path.display().to_string();
        let mut doc: DocumentMut = match text.parse() {
            Ok(doc) => doc,
            // The parser that follows reports where and why.
            Err(_) => return Ok(text.to_string()),
        };
        let here = std::env::current_dir().unwrap_or_default();
        let beside = absolute(&here, path).parent().map(Path::to_path_buf).unwrap_or_default();
        // A bag's files have the names that stand in its graph, and no place on the disk.
        let full =
            |name: &str| if files.are_on_disk() { absolute(&beside, Path::new(name)).display().to_string() } else { name.to_string() };
        rename_files(&mut doc, &full);
        // A program that is named with its folder lies beside the graph; a bare name is looked for as a shell would.
        rename_programs(&mut doc, &|name| if name.contains('/') { full(name) } else { name.to_string() });
        self.write_top(&mut doc);
        if let Some(law) = self.coupling {
            put_coupling(&mut doc, law.name(), &name)?;
        }
        self.write_nodes(&mut doc, &here, &name)?;
        Ok(doc.to_string())
    }

    fn write_top(&self, doc: &mut DocumentMut) {
        let mut gains = |key: &str, number: Option<f64>| {
            if let Some(number) = number {
                set(doc.as_table_mut().entry("gains").or_insert(toml_edit::table()), key, value(number));
            }
        };
        gains("mu", self.mu);
        gains("lambda", self.lambda);
        if let Some(rate) = self.rate_hz {
            doc["rate_hz"] = value(rate);
        }
        if let Some(duration) = self.duration_s {
            doc["duration_s"] = value(duration);
        }
        if let Some(clock) = self.clock {
            doc["clock"] = value(clock.word());
        }
        if self.record_origin {
            doc["record_origin"] = value(true);
        }
        if self.poll {
            doc["wait"] = value("poll");
        }
        if let Some(seed) = self.seed {
            doc["seed"] = value(seed.min(i64::MAX as u64) as i64);
        }
    }

    fn write_nodes(&self, doc: &mut DocumentMut, here: &Path, name: &str) -> Result<(), FileError> {
        let file = |path: &PathBuf| {
            let keep = path.as_os_str() == "none";
            value(if keep { "none".to_string() } else { absolute(here, path).display().to_string() })
        };
        let is_master = |path: &Option<PathBuf>| path.as_deref().is_some_and(|path| path.as_os_str() == MASTER);
        let of_master = OfMaster { model: is_master(&self.canceller), grip: is_master(&self.canceller_grip) };
        let of_master = OfMaster { grip: of_master.grip || of_master.model && self.canceller_grip.is_none(), ..of_master };
        let canceller = self.canceller.as_ref().filter(|_| !of_master.model).map(file);
        let canceller_grip = self.canceller_grip.as_ref().filter(|_| !of_master.grip).map(file);
        let (sensors, limits) = (self.sensors.map(|s| value(s.word())), self.limits.map(|l| value(l.word())));
        let wanted: [(&str, NodeKind, &str, Option<Item>); 17] = [
            ("--master", NodeKind::Master, "model", self.master.as_ref().map(file)),
            ("--grip", NodeKind::Master, "grip", self.grip.as_ref().map(file)),
            ("--slave", NodeKind::Slave, "model", self.slave.as_ref().map(file)),
            ("--environment", NodeKind::Slave, "environment", self.environment.as_ref().map(file)),
            ("--canceller", NodeKind::Canceller, "model", canceller),
            ("--canceller-grip", NodeKind::Canceller, "grip", canceller_grip),
            ("--high-pass", NodeKind::Canceller, "high_pass_hz", self.high_pass_hz.map(value)),
            ("--hand", NodeKind::Canceller, "hand", self.hand.map(|hand| value(hand.word()))),
            ("--edge-without", NodeKind::Canceller, "edge_without", self.edge_without.map(value)),
            ("--dither", NodeKind::Scaling, "dither", self.dither.as_deref().map(value)),
            ("--guard", NodeKind::Scaling, "guard", self.guard.map(value)),
            ("--bag", NodeKind::Recorder, "bag", self.bag.as_ref().map(file)),
            ("--sensors", NodeKind::Master, "sensors", sensors.clone()),
            ("--sensors", NodeKind::Slave, "sensors", sensors.clone()),
            ("--sensors", NodeKind::Rig, "sensors", sensors.clone()),
            ("--limits", NodeKind::Master, "limits", limits.clone()),
            ("--limits", NodeKind::Slave, "limits", limits.clone()),
        ];
        for (option, kind, key, item) in wanted {
            let Some(item) = item else { continue };
            let mut found = false;
            for node in node_tables(doc) {
                if node.get("kind").and_then(Item::as_str) == Some(kind.name()) {
                    node[key] = item.clone();
                    if matches!(option, "--master" | "--slave") {
                        // The model takes the place of a real device.
                        node.remove("device");
                        node.remove("emulator");
                    }
                    found = true;
                }
            }
            if !found && !matches!(option, "--sensors" | "--limits") {
                return Err(FileError::whole(name, format!("has no {} node, so {option} has no effect; omit it", kind.name())));
            }
        }
        of_master.write(doc, name)
    }
}

/// What `--canceller` and `--canceller-grip` take for what the graph's master is, besides files and `none`.
const MASTER: &str = "master";

/// What a canceller takes from the graph's master.
#[derive(Debug, Clone, Copy)]
struct OfMaster {
    model: bool,
    grip: bool,
}

impl OfMaster {
    /// Gives it to the cancellers.
    fn write(self, doc: &mut DocumentMut, name: &str) -> Result<(), FileError> {
        if !self.model && !self.grip {
            return Ok(());
        }
        let option = if self.model { "--canceller master" } else { "--canceller-grip master" };
        let is = |node: &toml_edit::Table, kind: NodeKind| node.get("kind").and_then(Item::as_str) == Some(kind.name());
        let of = |node: &toml_edit::Table, key: &str| node.get(key).and_then(Item::as_str).map(str::to_string);
        let master = node_tables(doc).find(|node| is(node, NodeKind::Master)).map(|node| (of(node, "model"), of(node, "grip")));
        let Some((Some(model), grip)) = master else {
            return Err(FileError::whole(name, format!("has no master with a model, so {option} has no effect; omit it")));
        };
        let mut found = false;
        for node in node_tables(doc).filter(|node| is(node, NodeKind::Canceller)) {
            if self.model {
                node["model"] = value(model.as_str());
            }
            if self.grip {
                node["grip"] = value(grip.as_deref().unwrap_or("none"));
            }
            found = true;
        }
        match found {
            true => Ok(()),
            false => Err(FileError::whole(name, format!("has no canceller node, so {option} has no effect; omit it"))),
        }
    }
}

fn node_tables(doc: &mut DocumentMut) -> impl Iterator<Item = &mut toml_edit::Table> {
    doc.get_mut("nodes").and_then(Item::as_array_of_tables_mut).into_iter().flat_map(|tables| tables.iter_mut())
}

fn set(table: &mut Item, key: &str, item: Item) {
    if let Some(table) = table.as_table_like_mut() {
        table.insert(key, item);
    }
}

/// Keys of node tables that hold excitations, which may name a file.
const EXCITATION_KEYS: &[&str] = &["force", "dither", "demand"];

/// Changes the names of the files that nodes are made of.
fn rename_files(doc: &mut DocumentMut, change: &dyn Fn(&str) -> String) {
    for node in node_tables(doc) {
        for key in FILE_KEYS {
            if let Some(Item::Value(value)) = node.get_mut(key)
                && value.as_str() != Some("none")
            {
                rewrite(value, change);
            }
        }
        for key in EXCITATION_KEYS {
            if let Some(Item::Value(value)) = node.get_mut(key) {
                rewrite(value, &|spec| Recorded::with_file(spec, change));
            }
        }
    }
}

/// Changes the names of the programs that nodes run.
fn rename_programs(doc: &mut DocumentMut, change: &dyn Fn(&str) -> String) {
    for node in node_tables(doc) {
        let program = match node.get_mut("command") {
            Some(Item::Value(Value::Array(words))) => words.get_mut(0),
            Some(Item::Value(value)) => Some(value),
            _ => None,
        };
        if let Some(program) = program.filter(|program| program.is_str()) {
            rewrite(program, change);
        }
    }
}

/// A graph's text with other names for the files that it is made of, and everything else unchanged. Text that is no TOML stays unchanged.
pub fn with_files_renamed(text: &str, change: &dyn Fn(&str) -> String) -> String {
    let Ok(mut doc) = text.parse::<DocumentMut>() else { return text.to_string() };
    rename_files(&mut doc, change);
    doc.to_string()
}

impl Graph {
    /// Its text and its files as a bag holds them. Files, programs and the bag have no folders, so that nothing identifies the machine on which it
    /// was made, unless the graph asks for that. Of files that are called the same the second is `2-NAME`.
    pub fn portable(&self) -> (String, Vec<(String, String)>) {
        let (Ok(mut doc), false) = (self.text.parse::<DocumentMut>(), self.record_origin) else {
            return (self.text.clone(), self.files.clone());
        };
        let mut names: Vec<String> = Vec::new();
        for (path, _) in &self.files {
            let own = bare(path);
            let with = |count: usize| if count == 1 { own.clone() } else { format!("{count}-{own}") };
            let name = (1..).map(with).find(|name| !names.contains(name)).unwrap_or(own.clone());
            names.push(name);
        }
        let given = |path: &str| self.files.iter().position(|(file, _)| file == path).and_then(|at| names.get(at).cloned());
        rename_files(&mut doc, &|path| given(path).unwrap_or_else(|| bare(path)));
        rename_programs(&mut doc, &bare);
        for node in node_tables(&mut doc) {
            if let Some(Item::Value(value)) = node.get_mut("bag") {
                rewrite(value, &bare);
            }
        }
        let files = names.iter().zip(&self.files).map(|(name, (_, text))| (name.clone(), text.clone())).collect();
        (doc.to_string(), files)
    }
}

/// A path without its folders.
fn bare(path: &str) -> String {
    Path::new(path).file_name().map_or_else(|| path.to_string(), |name| name.to_string_lossy().into_owned())
}

/// Changes a string, or each string of a list, and leaves comments and spaces where they are.
fn rewrite(value: &mut Value, change: &dyn Fn(&str) -> String) {
    match value {
        Value::String(text) => {
            let decor = text.decor().clone();
            *text = toml_edit::Formatted::new(change(text.value()));
            *text.decor_mut() = decor;
        }
        Value::Array(list) => list.iter_mut().for_each(|each| rewrite(each, change)),
        _ => {}
    }
}

/// The text with one experiment written into it and the list of experiments gone; unchanged where there is no such experiment.
pub(super) fn experiment_text(text: &str, name: &str) -> String {
    let Ok(mut doc) = text.parse::<DocumentMut>() else { return text.to_string() };
    let Some(Item::ArrayOfTables(experiments)) = doc.remove("experiments") else { return text.to_string() };
    let Some(experiment) = experiments.iter().find(|e| e.get("name").and_then(Item::as_str) == Some(name)) else {
        return text.to_string();
    };
    for (key, item) in experiment.iter() {
        match (key, item.as_table_like()) {
            ("duration_s", _) => doc["duration_s"] = item.clone(),
            (node_name, Some(changes)) => {
                for node in node_tables(&mut doc).filter(|n| n.get("name").and_then(Item::as_str) == Some(node_name)) {
                    for (key, item) in changes.iter() {
                        node[key] = item.clone();
                    }
                }
            }
            _ => {}
        }
    }
    doc.to_string()
}

/// `path` seen from `base`, without `.` and `..` where they can be resolved.
pub(super) fn absolute(base: &Path, path: &Path) -> PathBuf {
    let mut full = PathBuf::new();
    for part in base.join(path).components() {
        match part {
            std::path::Component::CurDir => {}
            std::path::Component::ParentDir => {
                full.pop();
            }
            part => full.push(part),
        }
    }
    full
}
