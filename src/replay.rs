//! `backdrive replay`: the recorded operator in, everything else executed again.

use crate::cli;
use crate::failure::Failure;
use crate::offered::with_recover;
use crate::output;
use crate::progress::busy;
use crate::run::{next, repeat_here};
use backdrive_bags::Reader;
use backdrive_control::cycle::Cycle;
use backdrive_control::operator::Intent;
use backdrive_msgs::{Message, Sample};
use backdrive_nodes::graph::{Node, NodeKind, Overrides, Settings};
use backdrive_nodes::stage::Clock;
use backdrive_pages::run::{Heard, page};
use backdrive_stability::bag_gate::held_back;
use backdrive_stability::summary::graph_of;
use backdrive_stability::unjudged::Unjudged;

/// Replays a bag in lockstep, in this process.
pub fn replay(options: &cli::Replay) -> Result<u8, Failure> {
    let path = &options.recording;
    let reader = Reader::open(path).map_err(Failure::input)?;
    let mut changes = options.changes.overrides(None);
    // Without a name for it, no second bag: the first must not be replaced.
    let bag = changes.bag.take();
    let mut graph = graph_of(&reader, &changes)?;
    graph.timing.clock = Clock::Lockstep;
    let here = std::env::current_dir().unwrap_or_default();
    graph.bag = bag.map(|bag| here.join(bag));
    if graph.bag.as_ref().is_some_and(|bag| bag.canonicalize().ok() == path.canonicalize().ok() && bag.exists()) {
        return Err(Failure::input(format!("{}: is the bag that is replayed; name another with --bag", path.display())));
    }

    let recorded_graph = graph_of(&reader, &Overrides::default())?;
    let exchanged = Overrides { duration_s: None, ..changes.clone() } != Overrides { overwrite: changes.overwrite, ..Overrides::default() };
    let (kept_back, notes) =
        busy(&format!("reading {}", path.display()), || held_back(&reader, &recorded_graph, exchanged)).map_err(Failure::input)?;
    if !reader.ended_cleanly() {
        output::note(format_args!("warning: {}: {}", path.display(), with_recover("was not closed; what it holds is replayed", path)));
    }
    let sources = |n: &Node| matches!(n.kind, NodeKind::Operator | NodeKind::Cycle);
    let Some(operator) = graph.nodes.iter().position(sources) else {
        return Err(Failure::input(format!("{}: its graph has no operator whose intent could be replayed", path.display())));
    };
    let recorded = |port: &str, read: &dyn Fn(&Sample, usize) -> [f64; 2]| {
        let topic = graph.topic_of(operator, port).name;
        let missing = reader.completeness().and_then(|c| c.topics.iter().find(|t| t.topic == topic)).map_or(0, |t| t.lost);
        if missing > 0 {
            output::note(format_args!(
                "warning: {}: {missing} messages of {topic} are missing; what they would change rests where it was",
                path.display()
            ));
        }
        busy(&format!("reading {}", path.display()), || rows_of(&reader, &topic, graph.nodes[operator].axes, read))
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
    graph.timing.steps = Some(options.changes.duration.map_or(steps, |d| ((d * graph.timing.rate_hz).round() as u64).max(1)));
    graph.nodes[operator].settings = settings;

    if let Some(html) = &options.result.html {
        output::writable(html)?;
    }
    let mut heard = Heard::of(&graph);
    let drawn = options.result.html.is_some();
    let mut done = repeat_here(&graph, &mut |topic, message| {
        if drawn {
            heard.take(topic, message);
        }
    })?;
    // The run above is whole, but what it was made of is not where the recording is not, or is contradictory.
    if let Some(summary) = &mut done.summary {
        for note in notes.iter().filter(|_| kept_back.is_some()) {
            output::note(format_args!("warning: {}: {note}", path.display()));
        }
        // Who asks for another length does not ask for the recorded one.
        let is_asked = |why: &Unjudged| !(options.changes.duration.is_some() && matches!(why, Unjudged::CutShort { .. }));
        summary.hold_back(kept_back.filter(is_asked));
    }
    let steps = next(&done, &graph, Some(path));
    let page = options.result.html.as_deref().map(|html| (html, page(&done.shown(), &graph, &heard, &steps)));
    done.tell(page, options.result.json, &steps)
}

/// Two numbers per step, per axis.
type Rows = Vec<Vec<[f64; 2]>>;

/// Two numbers of a topic's samples per axis, one pair per step, and how many steps the bag holds.
fn rows_of(reader: &Reader, topic: &str, axes: usize, read: &dyn Fn(&Sample, usize) -> [f64; 2]) -> Result<(Rows, u64), Failure> {
    let path = reader.path();
    reader.topic(topic).map_err(Failure::input)?;
    let mut samples: Vec<(u64, Vec<[f64; 2]>)> = Vec::new();
    for entry in reader.messages().map_err(Failure::input)? {
        let entry = entry.map_err(Failure::input)?;
        if entry.topic.name != topic {
            continue;
        }
        if let Some(Message::Sample(sample)) = entry.message(path).map_err(Failure::input)? {
            samples.push((sample.step, (0..axes).map(|axis| read(&sample, axis)).collect()));
        }
    }
    let Some(last) = samples.iter().map(|(step, _)| *step).max() else {
        return Err(Failure::input(format!("{}: holds no message on {topic}", path.display())));
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
