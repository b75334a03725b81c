//! Runs a graph once per experiment, and leaves sets of recordings.

use crate::cli;
use crate::failure::Failure;
use crate::run::run_graph;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides, Settings};
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Runs every experiment of a graph and writes one set of recordings, or one per step of a protocol: a folder with a
/// bag per experiment, `set.toml` and the model of the device that was recorded.
pub fn run(options: &cli::Run, graph: &Graph, changes: &Overrides) -> Result<u8, Failure> {
    if options.changes.bag.is_some() {
        return Err(Failure::input(format!("{}: has several experiments; name their folder with --out", options.graph.display())));
    }
    let stem = options.graph.file_stem().map_or("experiments".into(), |s| s.to_string_lossy().to_string());
    let out = options.out.clone().unwrap_or_else(|| PathBuf::from(stem));
    let mut sets: Vec<Set> = Vec::new();
    let mut worst = 0;
    for (index, experiment) in graph.experiments.iter().enumerate() {
        let folder = experiment.step.as_ref().map_or(out.clone(), |step| out.join(step));
        std::fs::create_dir_all(&folder).map_err(|e| Failure::write(&folder, e))?;
        let file = format!("{}.mcap", experiment.name);
        let changes = Overrides { bag: Some(folder.join(&file)), ..changes.clone() };
        let each = Graph::load_experiment(&options.graph, &changes, &experiment.name)?;
        eprintln!("{}/{}  {}{}", index + 1, graph.experiments.len(), experiment.name, if experiment.held_out { " (held out)" } else { "" });
        let done = run_graph(&each, options.transport)?;
        // Of an experiment it does not matter whether a loop was stable: there is none. Losses do.
        let code = done.exit_code();
        if code > 1 {
            return Ok(code);
        }
        worst = worst.max(if done.lost > 0 { code } else { 0 });
        let set = match sets.iter().position(|s| s.folder == folder) {
            Some(index) => &mut sets[index],
            None => {
                sets.push(Set::new(folder, &each)?);
                let last = sets.len() - 1;
                &mut sets[last]
            }
        };
        let list = if experiment.held_out { &mut set.held_out } else { &mut set.fit };
        list.push(file);
    }
    for set in &sets {
        set.write()?;
    }
    if options.json {
        let sets: Vec<_> = sets.iter().map(|s| json!({ "set": s.folder, "fit": s.fit, "held_out": s.held_out })).collect();
        println!("{}", json!({ "sets": sets }));
    } else {
        for set in &sets {
            println!("{}: {} recordings to fit, {} held out", set.folder.join("set.toml").display(), set.fit.len(), set.held_out.len());
        }
    }
    Ok(worst)
}

/// A set of recordings in the making.
struct Set {
    folder: PathBuf,
    model: String,
    columns: Vec<(String, String, String)>,
    fit: Vec<String>,
    held_out: Vec<String>,
}

impl Set {
    fn new(folder: PathBuf, graph: &Graph) -> Result<Set, Failure> {
        let master = graph.nodes.iter().position(|n| n.kind == NodeKind::Master);
        let device = master.map(|index| (index, &graph.nodes[index].settings));
        let Some((index, Settings::Master(files))) = device else {
            return Err(Failure::input(format!("{}: experiments need a master to be recorded", graph.path.display())));
        };
        let Some(model) = &files.model else {
            return Err(Failure::input(format!("{}: experiments need a master's model", graph.path.display())));
        };
        // What is recorded is the device as held: its grip is part of the model, the hand at rest.
        let mut held = model.clone();
        let mut columns = Vec::new();
        let topic = graph.topic_of(index, "measured").name;
        for (number, axis) in model.axes.iter().enumerate() {
            let (input, output) = (&model.inputs[axis.feedback].name, &model.outputs[axis.measured].name);
            columns.push((input.clone(), topic.clone(), format!("effort[{number}]")));
            columns.push((output.clone(), topic.clone(), format!("position[{number}]")));
            if let Some(fragment) = &files.fragment {
                let several = model.axes.len() > 1;
                let prefix = if several { format!("{}{number}", fragment.network.name) } else { fragment.network.name.clone() };
                let attached = held.attach(fragment, axis.user, &prefix);
                if let Some(hand) = attached.hand_input {
                    let intent = graph.nodes.iter().position(|n| n.kind == NodeKind::Operator);
                    if let Some(intent) = intent {
                        let topic = graph.topic_of(intent, "intent").name;
                        columns.push((held.inputs[hand].name.clone(), topic, format!("position[{number}]")));
                    }
                }
            }
        }
        for axis in &mut held.axes {
            axis.holds_user = files.fragment.is_some();
        }
        // Only what is recorded can be compared.
        let kept: Vec<usize> = model.axes.iter().map(|a| a.measured).collect();
        let wanted = |index: usize| kept.contains(&index);
        let renumber = |index: usize| (0..index).filter(|i| wanted(*i)).count();
        let mut number = 0;
        held.outputs.retain(|_| {
            number += 1;
            wanted(number - 1)
        });
        held.axes.iter_mut().for_each(|a| a.measured = renumber(a.measured));
        Ok(Set { folder, model: held.to_toml(), columns, fit: Vec::new(), held_out: Vec::new() })
    }

    fn write(&self) -> Result<(), Failure> {
        let quoted = |names: &[String]| names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ");
        let mut text = String::from("# Recordings of one device; `held_out` are kept from every fit.\n");
        let _ = writeln!(text, "model    = \"model.toml\"");
        let _ = writeln!(text, "fit      = [{}]", quoted(&self.fit));
        let _ = writeln!(text, "held_out = [{}]", quoted(&self.held_out));
        let _ = writeln!(text, "initial  = \"rest\"\n\n[columns]");
        for (name, topic, field) in &self.columns {
            let _ = writeln!(text, "\"{name}\" = {{ topic = \"{topic}\", field = \"{field}\" }}");
        }
        put(&self.folder.join("set.toml"), &text)?;
        put(&self.folder.join("model.toml"), &self.model)
    }
}

fn put(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(|e| Failure::write(path, e))
}
