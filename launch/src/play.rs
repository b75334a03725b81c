//! A bag's messages again, verbatim, for whoever listens.

use crate::RunHome;
use crate::carry_error::CarryError;
use backdrive_bags::{BagError, BagHeader, Entry, PlayOptions, PlayReport, Reader, Sink, play as play_bag};
use backdrive_msgs::Message;
use backdrive_msgs::topic::Topic;
use backdrive_nodes::graph::with_files_renamed;
use backdrive_nodes::transport::iceoryx2::Iceoryx2;
use backdrive_nodes::transport::{Publisher, Transport};
use std::collections::HashMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Publishes every message of ours over shared memory, at its time times 1 / `speed`, until the end of the bag or until `stop` is true.
/// `note` hears once where it is played.
///
/// # Errors
/// The bag cannot be read, or shared memory or the directory of the run cannot be used.
pub fn play(bag: &Path, speed: f64, stop: &AtomicBool, note: &dyn Fn(&str)) -> Result<PlayReport, CarryError> {
    let reader = Reader::open(bag).map_err(CarryError::input)?;
    let home = RunHome::system();
    let graph = reader.header().map_or(String::new(), graph_of);
    let run = home.create(&graph, 1)?;
    lay_out(reader.header().map_or(&[], |header| &header.files), &run.paths().root().join(FILES))?;
    let mut transport = Iceoryx2::open(&run.paths().location(), "player").map_err(CarryError::machine)?;
    let mut publishers: HashMap<String, Box<dyn Publisher>> = HashMap::new();
    for topic in reader.topics() {
        if let Some(kind) = topic.kind {
            let one = transport.publisher(&Topic { name: topic.name.clone(), kind }, 0).map_err(CarryError::machine)?;
            publishers.insert(topic.name.clone(), one);
        }
    }
    note(&format!(
        "playing {} topics of {} at {speed} times real time, in the run {}",
        publishers.len(),
        bag.display(),
        run.paths().root().display()
    ));
    let mut sink = Speaker { publishers, stop };
    let options = PlayOptions { rate: speed, ..PlayOptions::default() };
    let report = play_bag(&reader, &options, &mut sink).map_err(CarryError::input);
    drop((sink, transport));
    run.remove()?;
    report
}

/// Folder of the bag's files beside the graph in the directory of the run.
const FILES: &str = "files";

/// The graph of a bag, in which the bag's files are called as [`lay_out`] calls them: whoever joins the run can read it.
fn graph_of(header: &BagHeader) -> String {
    let place = |name: &str| header.files.iter().position(|(file, _)| file == name);
    with_files_renamed(&header.graph_toml, &|name| place(name).map_or_else(|| name.to_string(), |at| format!("{FILES}/{at}")))
}

/// Writes the bag's files, each under its number, for its name may be anything.
fn lay_out(files: &[(String, String)], folder: &Path) -> Result<(), CarryError> {
    std::fs::create_dir_all(folder).map_err(|e| unwritten(folder, e))?;
    for (at, (_, text)) in files.iter().enumerate() {
        let path = folder.join(at.to_string());
        std::fs::write(&path, text).map_err(|e| unwritten(&path, e))?;
    }
    Ok(())
}

fn unwritten(path: &Path, error: std::io::Error) -> CarryError {
    CarryError::Machine(format!("{}: cannot be written: {error}", path.display()))
}

struct Speaker<'a> {
    publishers: HashMap<String, Box<dyn Publisher>>,
    stop: &'a AtomicBool,
}

impl Sink for Speaker<'_> {
    fn send(&mut self, entry: &Entry, message: Option<&Message>) -> Result<(), BagError> {
        match (message, self.publishers.get_mut(&entry.topic.name)) {
            (Some(message), Some(publisher)) => publisher.send(message).map_err(|e| BagError::Usage(e.to_string())),
            _ => Ok(()),
        }
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }
}
