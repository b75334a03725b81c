//! Runs a graph once per experiment, and leaves sets of recordings.

use crate::cli;
use crate::failure::Failure;
use crate::output;
use crate::run::{Way, run_graph};
use backdrive_bags::check_target;
use backdrive_nodes::graph::{Experiment, Graph, Overrides};
use backdrive_plant::tomlfile::FileError;
use backdrive_sets::experiments::{Device, Set, within_travel};
use serde_json::json;
use std::path::PathBuf;

/// Runs every experiment of a graph and writes one set of recordings, or one per step of a protocol: a folder with a
/// bag per experiment, `set.toml` and the model of the device that was recorded.
pub fn run(options: &cli::Run, way: &Way, graph: &Graph, changes: &Overrides) -> Result<u8, Failure> {
    if options.result.html.is_some() {
        return Err(Failure::input(format!("{}: has several experiments, and --html is the page of one run", options.graph.display())));
    }
    if options.changes.bag.is_some() {
        return Err(Failure::input(format!("{}: has several experiments; name their folder with --out", options.graph.display())));
    }
    let stem = options.graph.file_stem().map_or("experiments".into(), |s| s.to_string_lossy().to_string());
    let out = options.out.clone().unwrap_or_else(|| PathBuf::from(stem));
    // All are read before the first runs: what is wrong with the last is reported now.
    let load = |e: &Experiment| {
        let folder = e.step.as_ref().map_or(out.clone(), |step| out.join(step));
        let changes = Overrides { bag: Some(folder.join(format!("{}.mcap", e.name))), ..changes.clone() };
        Ok((folder, Graph::load_experiment(&options.graph, &changes, &e.name)?))
    };
    let graphs = graph.experiments.iter().map(load).collect::<Result<Vec<_>, Failure>>()?;
    for bag in graphs.iter().filter_map(|(_, g)| g.bag.as_deref()).filter(|b| b.exists()) {
        check_target(bag, changes.overwrite).map_err(Failure::bag)?;
    }
    let mut sets: Vec<Set> = Vec::new();
    for (index, (experiment, (folder, each))) in graph.experiments.iter().zip(graphs).enumerate() {
        std::fs::create_dir_all(&folder).map_err(|e| Failure::write(&folder, e))?;
        let device = Device::of(&each)?;
        let set = match sets.iter().position(|s| s.folder == folder) {
            Some(there) => there,
            None => {
                sets.push(Set::new(folder, &device));
                sets.len() - 1
            }
        };
        sets[set].add(experiment, &device).map_err(|message| at(graph, experiment, message))?;
        output::note(format_args!(
            "{}/{}  {}{}",
            index + 1,
            graph.experiments.len(),
            experiment.name,
            if experiment.held_out { " (held out)" } else { "" }
        ));
        let done = run_graph(&each.clone().on_one_host(), way)?;
        // Of an experiment it does not matter whether a loop was stable: there is none. Losses do.
        let code = done.fault_code();
        if code != 0 {
            let what = done.text().lines().find(|line| line.starts_with("ended ") || line.starts_with("UNREADABLE ")).map(str::to_string);
            let what = what.unwrap_or_else(|| format!("{} messages were lost", done.lost));
            return Err(Failure { code, message: format!("{}: experiment \"{}\": {what}", graph.path.display(), experiment.name) });
        }
        if let Some(bag) = &done.bag {
            within_travel(bag, &device).map_err(|e| at(graph, experiment, e.to_string()))?;
        }
    }
    for set in &sets {
        for (name, text) in set.texts() {
            output::file(&set.folder.join(name), text)?;
        }
    }
    if options.result.json {
        let sets: Vec<_> = sets.iter().map(|s| json!({ "set": s.folder, "fit": s.fit, "held_out": s.held_out })).collect();
        output::line(json!({ "sets": sets }))?;
    } else {
        for set in &sets {
            output::line(format_args!(
                "{}: {} recordings to fit, {} held out",
                set.folder.join("set.toml").display(),
                set.fit.len(),
                set.held_out.len()
            ))?;
        }
    }
    Ok(0)
}

/// An error at an experiment's line.
fn at(graph: &Graph, experiment: &Experiment, message: String) -> Failure {
    Failure::from(FileError::at(graph.path.display().to_string(), experiment.line, format!("experiment \"{}\"", experiment.name), message))
}
