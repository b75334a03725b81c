//! Experiments, and errors about them.

use crate::graph::{Experiment, Graph};
use backdrive_plant::elements::Range;
use backdrive_plant::tomlfile::{FileError, Table, unknown};
use std::path::Path;

pub(super) fn read_experiment(mut table: Table, graph: &Graph) -> Result<Experiment, FileError> {
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

/// An error about a graph that an experiment was written into, at the experiment's line: the other lines are not the file's.
pub(super) fn in_experiment(error: FileError, whole: &str, path: &Path, name: &str) -> FileError {
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
