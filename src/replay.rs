//! `backdrive replay`: the recorded operator in, everything else executed again.

use crate::cli;
use crate::failure::Failure;
use crate::run::run_here;
use crate::summary::graph_of;
use backdrive_bags::Reader;
use backdrive_control::operator::Intent;
use backdrive_msgs::Message;
use backdrive_nodes::graph::{NodeKind, Settings};
use backdrive_nodes::stage::Clock;

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

    if !reader.ended_cleanly() {
        eprintln!("warning: {}: was not closed; what it holds is replayed, and `backdrive bag recover` makes a clean copy", path.display());
    }
    let Some(operator) = graph.nodes.iter().position(|n| n.kind == NodeKind::Operator) else {
        return Err(Failure::input(format!("{}: its graph has no operator whose intent could be replayed", path.display())));
    };
    let topic = graph.topic_of(operator, "intent").name;
    let missing = reader.completeness().and_then(|c| c.topics.iter().find(|t| t.topic == topic)).map_or(0, |t| t.lost);
    if missing > 0 {
        eprintln!("warning: {}: {missing} messages of {topic} are missing; the hand rests where it was", path.display());
    }
    let (intents, steps) = recorded_intents(&reader, &topic, graph.nodes[operator].axes)?;
    graph.timing.steps = Some(options.changes.duration.map_or(steps, |d| ((d * graph.timing.rate_hz).round() as u64).max(1)));
    graph.nodes[operator].settings = Settings::Operator(intents);

    let done = run_here(&graph, &mut |_, _| {})?;
    if options.json {
        println!("{}", done.json());
    } else {
        println!("{}", done.text());
    }
    Ok(done.exit_code())
}

/// The hand's motion per axis, one value per step, and how many steps the bag holds.
fn recorded_intents(reader: &Reader, topic: &str, axes: usize) -> Result<(Vec<Intent>, u64), Failure> {
    let path = reader.path();
    reader.topic(topic).map_err(Failure::input)?;
    let mut samples: Vec<(u64, Vec<[f64; 2]>)> = Vec::new();
    for entry in reader.messages().map_err(Failure::input)? {
        let entry = entry.map_err(Failure::input)?;
        if entry.topic.name != topic {
            continue;
        }
        if let Some(Message::Sample(sample)) = entry.message(path).map_err(Failure::input)? {
            samples.push((sample.step, (0..axes).map(|a| [sample.position[a], sample.velocity[a]]).collect()));
        }
    }
    let Some(last) = samples.iter().map(|(step, _)| *step).max() else {
        return Err(Failure::input(format!("{}: holds no message on {topic}", path.display())));
    };
    // A step whose sample was lost keeps the value before it.
    let mut rows: Vec<Vec<[f64; 2]>> = vec![vec![[0.0, 0.0]; last as usize + 1]; axes];
    samples.sort_by_key(|(step, _)| *step);
    for (index, (step, values)) in samples.iter().enumerate() {
        let until = samples.get(index + 1).map_or(last + 1, |(next, _)| *next);
        for (axis, value) in values.iter().enumerate() {
            rows[axis][*step as usize..until as usize].fill(*value);
        }
    }
    Ok((rows.into_iter().map(Intent::Recorded).collect(), last + 1))
}
