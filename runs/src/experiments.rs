//! Runs a graph once per experiment, and leaves sets of recordings.

use crate::error::RunError;
use crate::watch::Watch;
use crate::way::{Way, run_graph};
use backdrive_bags::check_target;
use backdrive_nodes::graph::{Experiment, Graph, Overrides};
use backdrive_plant::tomlfile::FileError;
use backdrive_sets::experiments::{Device, Set, within_travel};
use std::path::{Path, PathBuf};

/// How the experiments of a graph are run.
pub struct Options<'a> {
    /// The graph file.
    pub file: &'a Path,
    /// Its changes, which name no bag.
    pub changes: &'a Overrides,
    /// How the nodes are carried out.
    pub way: &'a Way,
    /// Folder of the sets; `None` for one that is called like the graph file.
    pub out: Option<&'a Path>,
}

/// Runs every experiment of a graph and gives one set of recordings, or one for each step of a protocol. The bags of a set are in its folder;
/// `set.toml` and the model of the device are yet to be written ([`Set::texts`]).
///
/// # Errors
/// An experiment cannot be read, its bag exists or cannot be written, its run did not go as it should, or the device left its travel.
pub fn run(graph: &Graph, options: &Options, watch: &dyn Watch) -> Result<Vec<Set>, RunError> {
    let Options { file, changes, way, out } = *options;
    let stem = file.file_stem().map_or("experiments".into(), |s| s.to_string_lossy().to_string());
    let out = out.map_or_else(|| PathBuf::from(stem), Path::to_path_buf);
    // All are read before the first runs: what is wrong with the last is reported now.
    let load = |e: &Experiment| {
        let folder = e.step.as_ref().map_or(out.clone(), |step| out.join(step));
        let changes = Overrides { bag: Some(folder.join(format!("{}.mcap", e.name))), ..changes.clone() };
        Ok((folder, Graph::load_experiment(file, &changes, &e.name)?))
    };
    let graphs = graph.experiments.iter().map(load).collect::<Result<Vec<_>, RunError>>()?;
    for bag in graphs.iter().filter_map(|(_, g)| g.bag.as_deref()).filter(|b| b.exists()) {
        check_target(bag, changes.overwrite).map_err(RunError::Bag)?;
    }
    let mut sets: Vec<Set> = Vec::new();
    for (index, (experiment, (folder, each))) in graph.experiments.iter().zip(graphs).enumerate() {
        std::fs::create_dir_all(&folder).map_err(|e| RunError::machine(format!("{}: cannot be written: {e}", folder.display())))?;
        let device = Device::of(&each)?;
        let set = match sets.iter().position(|s| s.folder == folder) {
            Some(there) => there,
            None => {
                sets.push(Set::new(folder, &device));
                sets.len() - 1
            }
        };
        sets[set].add(experiment, &device).map_err(|message| at(graph, experiment, message))?;
        watch.note(&format!(
            "{}/{}  {}{}",
            index + 1,
            graph.experiments.len(),
            experiment.name,
            if experiment.held_out { " (held out)" } else { "" }
        ));
        let done = run_graph(&each.clone().on_one_host(), way, watch)?;
        // Of an experiment it does not matter whether a loop was stable: there is none. Losses do.
        if let Some(fault) = done.fault() {
            let what = done.ended().unwrap_or_else(|| format!("{} messages were lost", done.lost));
            return Err(RunError::Experiment {
                fault,
                message: format!("{}: experiment \"{}\": {what}", graph.path.display(), experiment.name),
            });
        }
        if let Some(bag) = &done.bag {
            within_travel(bag, &device).map_err(|e| at(graph, experiment, e.to_string()))?;
        }
    }
    Ok(sets)
}

/// An error at an experiment's line.
fn at(graph: &Graph, experiment: &Experiment, message: String) -> RunError {
    RunError::from(FileError::at(graph.path.display().to_string(), experiment.line, format!("experiment \"{}\"", experiment.name), message))
}
