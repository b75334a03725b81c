//! `backdrive bag play`: a bag's messages again, verbatim, for whoever listens.

use crate::failure::{Failure, code};
use crate::output;
use crate::progress::busy;
use backdrive_bags::{BagError, BagHeader, Entry, PlayOptions, Reader, Sink, play as play_bag};
use backdrive_launch::RunHome;
use backdrive_msgs::Message;
use backdrive_msgs::topic::Topic;
use backdrive_nodes::graph::with_files_renamed;
use backdrive_nodes::transport::iceoryx2::Iceoryx2;
use backdrive_nodes::transport::{Publisher, Transport};
use std::collections::HashMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

extern "C" fn on_interrupt(_: i32) {
    INTERRUPTED.store(true, Ordering::SeqCst);
}

/// Publishes every message of ours over shared memory, at its time.
pub fn play(bag: &Path, speed: f64) -> Result<u8, Failure> {
    if !(speed.is_finite() && speed > 0.0) {
        return Err(Failure { code: 2, message: format!("--speed must be above 0, is {speed}") });
    }
    let reader = Reader::open(bag).map_err(Failure::input)?;
    let home = RunHome::system();
    let graph = reader.header().map_or(String::new(), graph_of);
    let run = home.create(&graph, 1).map_err(Failure::from)?;
    lay_out(reader.header().map_or(&[], |header| &header.files), &run.paths().root().join(FILES))?;
    // SAFETY: the handler does nothing but store to an atomic.
    unsafe {
        let handler = nix::sys::signal::SigHandler::Handler(on_interrupt);
        nix::sys::signal::signal(nix::sys::signal::Signal::SIGINT, handler).map_err(Failure::machine)?;
    }
    let mut transport = Iceoryx2::open(&run.paths().location(), "player").map_err(Failure::machine)?;
    let mut publishers: HashMap<String, Box<dyn Publisher>> = HashMap::new();
    for topic in reader.topics() {
        if let Some(kind) = topic.kind {
            let one = transport.publisher(&Topic { name: topic.name.clone(), kind }, 0).map_err(Failure::machine)?;
            publishers.insert(topic.name.clone(), one);
        }
    }
    output::note(format_args!(
        "playing {} topics of {} at {speed} times real time, in the run {}",
        publishers.len(),
        bag.display(),
        run.paths().root().display()
    ));
    let mut sink = Speaker { publishers };
    let options = PlayOptions { rate: speed, ..PlayOptions::default() };
    let report = busy(&format!("playing {}", bag.display()), || play_bag(&reader, &options, &mut sink)).map_err(Failure::input);
    drop((sink, transport));
    run.remove().map_err(Failure::from)?;
    let report = report?;
    output::line(format_args!("{}: {} messages sent, the latest {:.3} ms late", bag.display(), report.sent, report.latest_s * 1e3))?;
    Ok(if report.finished { 0 } else { code::INTERRUPTED })
}

/// Folder of the bag's files beside the graph in the directory of the run.
const FILES: &str = "files";

/// The graph of a bag, in which the bag's files are called as [`lay_out`] calls them: whoever joins the run can read it.
fn graph_of(header: &BagHeader) -> String {
    let place = |name: &str| header.files.iter().position(|(file, _)| file == name);
    with_files_renamed(&header.graph_toml, &|name| place(name).map_or_else(|| name.to_string(), |at| format!("{FILES}/{at}")))
}

/// Writes the bag's files, each under its number, for its name may be anything.
fn lay_out(files: &[(String, String)], folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).map_err(|e| Failure::write(folder, e))?;
    for (at, (_, text)) in files.iter().enumerate() {
        let path = folder.join(at.to_string());
        std::fs::write(&path, text).map_err(|e| Failure::write(&path, e))?;
    }
    Ok(())
}

struct Speaker {
    publishers: HashMap<String, Box<dyn Publisher>>,
}

impl Sink for Speaker {
    fn send(&mut self, entry: &Entry, message: Option<&Message>) -> Result<(), BagError> {
        match (message, self.publishers.get_mut(&entry.topic.name)) {
            (Some(message), Some(publisher)) => publisher.send(message).map_err(|e| BagError::Usage(e.to_string())),
            _ => Ok(()),
        }
    }

    fn stopped(&self) -> bool {
        INTERRUPTED.load(Ordering::SeqCst)
    }
}
