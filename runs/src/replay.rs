//! A recording run again: the recorded operator in, everything else executed again.

use crate::done::Done;
use crate::error::RunError;
use crate::watch::Watch;
use crate::way::repeat_here;
use backdrive_bags::Reader;
use backdrive_control::cycle::Cycle;
use backdrive_control::operator::Intent;
use backdrive_msgs::{Message, Sample};
use backdrive_nodes::graph::{Graph, Node, NodeKind, Overrides, Settings};
use backdrive_nodes::stage::Clock;
use backdrive_stability::bag_gate::held_back;
use backdrive_stability::summary::graph_of;
use backdrive_stability::unjudged::Unjudged;
use std::path::{Path, PathBuf};

/// A replay that is ready to run.
pub struct Replay {
    /// The graph of the bag with its changes, its operator the recorded one.
    pub graph: Graph,
    /// Whether the bag was not closed, so that what it holds is replayed.
    pub is_cut: bool,
    path: PathBuf,
    /// What keeps a replay of this recording from being judged, and what a person should know of that.
    kept_back: Option<Unjudged>,
    notes: Vec<String>,
}

impl Replay {
    /// Reads a bag. Without a name for it in the changes no second bag is recorded: the first must not be replaced.
    ///
    /// # Errors
    /// The bag cannot be read, holds no operator, is the one that would be written, or its graph does not take the changes.
    pub fn read(path: &Path, changes: &Overrides, watch: &dyn Watch) -> Result<Replay, RunError> {
        let reader = Reader::open_begun(path).map_err(RunError::input)?;
        let mut changes = changes.clone();
        let duration_s = changes.duration_s;
        // Without a name for it, no second bag: the first must not be replaced.
        let bag = changes.bag.take();
        let mut graph = graph_of(&reader, &changes)?;
        graph.timing.clock = Clock::Lockstep;
        let here = std::env::current_dir().unwrap_or_default();
        graph.bag = bag.map(|bag| here.join(bag));
        if graph.bag.as_ref().is_some_and(|bag| bag.canonicalize().ok() == path.canonicalize().ok() && bag.exists()) {
            return Err(RunError::input(format!("{}: is the bag that is replayed; name another with --bag", path.display())));
        }

        let recorded_graph = graph_of(&reader, &Overrides::default())?;
        let exchanged =
            Overrides { duration_s: None, ..changes.clone() } != Overrides { overwrite: changes.overwrite, ..Overrides::default() };
        let reading = watch.begins(&format!("reading {}", path.display()));
        let (kept_back, notes) = held_back(&reader, &recorded_graph, exchanged).map_err(RunError::input)?;
        drop(reading);
        let sources = |n: &Node| matches!(n.kind, NodeKind::Operator | NodeKind::Cycle);
        let Some(operator) = graph.nodes.iter().position(sources) else {
            return Err(RunError::input(format!("{}: its graph has no operator whose intent could be replayed", path.display())));
        };
        let recorded = |port: &str, read: &dyn Fn(&Sample, usize) -> [f64; 2]| {
            let topic = graph.topic_of(operator, port).name;
            let missing = reader.completeness().and_then(|c| c.topics.iter().find(|t| t.topic == topic)).map_or(0, |t| t.lost);
            if missing > 0 {
                watch.note(&format!("warning: {}: {missing} messages of {topic} are missing; the last values are held", path.display()));
            }
            let _reading = watch.begins(&format!("reading {}", path.display()));
            rows_of(&reader, &topic, graph.nodes[operator].axes, read)
        };
        let (settings, steps) = if graph.nodes[operator].kind == NodeKind::Cycle {
            let (pedal, steps) = recorded("pedal", &|s, axis| [s.position[axis], 0.0])?;
            let (speed, _) = recorded("speed", &|s, axis| [s.velocity[axis], 0.0])?;
            let both = pedal.iter().flatten().zip(speed.iter().flatten());
            (Settings::Cycle(Cycle::Recorded(both.map(|(p, s)| [p[0], s[0]]).collect())), steps)
        } else {
            let (rows, steps) = recorded("intent", &|s, axis| [s.position[axis], s.velocity[axis]])?;
            (Settings::Operator(rows.into_iter().map(Intent::Recorded).collect()), steps)
        };
        graph.timing.steps = Some(duration_s.map_or(steps, |d| ((d * graph.timing.rate_hz).round() as u64).max(1)));
        graph.nodes[operator].settings = settings;
        // Who asks for another length does not ask for the recorded one.
        let is_asked = |why: &Unjudged| !(duration_s.is_some() && matches!(why, Unjudged::CutShort { .. }));
        let notes = if kept_back.is_some() { notes } else { Vec::new() };
        let kept_back = kept_back.filter(is_asked);
        Ok(Replay { graph, is_cut: !reader.ended_cleanly(), path: path.to_path_buf(), kept_back, notes })
    }

    /// Runs it in lockstep, in this process; `hear` gets every message with its topic.
    ///
    /// # Errors
    /// As [`repeat_here`].
    pub fn run(&self, watch: &dyn Watch, hear: &mut dyn FnMut(&str, &Message)) -> Result<Done, RunError> {
        let mut done = repeat_here(&self.graph, watch, hear)?;
        // The run is whole, but what it was made of is not where the recording is not, or is contradictory.
        if let Some(summary) = &mut done.summary {
            self.notes.iter().for_each(|note| watch.note(&format!("warning: {}: {note}", self.path.display())));
            summary.hold_back(self.kept_back);
        }
        Ok(done)
    }
}

/// Two numbers per step, per axis.
type Rows = Vec<Vec<[f64; 2]>>;

/// Two numbers of a topic's samples per axis, one pair per step, and how many steps the bag holds.
fn rows_of(reader: &Reader, topic: &str, axes: usize, read: &dyn Fn(&Sample, usize) -> [f64; 2]) -> Result<(Rows, u64), RunError> {
    let path = reader.path();
    reader.topic(topic).map_err(RunError::input)?;
    let mut samples: Vec<(u64, Vec<[f64; 2]>)> = Vec::new();
    for entry in reader.messages().map_err(RunError::input)? {
        let entry = entry.map_err(RunError::input)?;
        if entry.topic.name != topic {
            continue;
        }
        if let Some(Message::Sample(sample)) = entry.message(path).map_err(RunError::input)? {
            samples.push((sample.step, (0..axes).map(|axis| read(&sample, axis)).collect()));
        }
    }
    let Some(last) = samples.iter().map(|(step, _)| *step).max() else {
        return Err(RunError::input(format!("{}: contains no message on {topic}", path.display())));
    };
    // A step whose sample was lost keeps the value before it.
    let mut rows: Rows = vec![vec![[0.0, 0.0]; last as usize + 1]; axes];
    samples.sort_by_key(|(step, _)| *step);
    for (index, (step, values)) in samples.iter().enumerate() {
        let until = samples.get(index + 1).map_or(last + 1, |(next, _)| *next);
        for (axis, value) in values.iter().enumerate() {
            rows[axis][*step as usize..until as usize].fill(*value);
        }
    }
    Ok((rows, last + 1))
}
