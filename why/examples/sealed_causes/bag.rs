//! The bag of a hidden loop, and what is said of it by who has nothing else.

use backdrive_bags::Recorder;
use backdrive_launch::join::{recorder_options, recording};
use backdrive_nodes::build::{plan, plan_with};
use backdrive_nodes::graph::{Graph, NodeKind};
use backdrive_nodes::sequence::Sequence;
use backdrive_why::answer::Answer;
use backdrive_why::recording::Recording;
use backdrive_why::trial::Trial;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Records the hidden loop; the bag holds the graph that was declared.
pub fn record(declared: &Graph, truth: &Trial, bag: &Path) {
    let mut declared = declared.clone();
    declared.overwrite = true;
    let graph = &truth.graph;
    let own = truth.cores();
    let nodes = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder);
    let plans = nodes.map(|n| match own.as_ref().and_then(|own| own(graph, n, 1.0)) {
        Some(cores) => plan_with(graph, &n.name, cores.expect("cores")).expect("a node"),
        None => plan(graph, &n.name).expect("a node"),
    });
    let mut sequence = Sequence::new(plans.collect(), &graph.timing).expect("a loop");
    let (record, header) = recording(&declared, "recorder", None);
    let place: Vec<Option<usize>> = sequence.topics().iter().map(|t| record.topics.iter().position(|r| r.name == t.name)).collect();
    let mut recorder = Recorder::create(bag, &header, &recorder_options(&declared)).expect("a bag");
    sequence.run(
        graph.timing.steps.unwrap_or(1),
        Some(&mut |topic, message| {
            if let Some(place) = place[topic] {
                recorder.push(place, *message, 0).expect("a message");
            }
        }),
    );
    recorder.finish().expect("the end of a bag");
}

/// What is said of a bag by who has nothing else.
pub fn asked(bag: &Path) -> Answer {
    let recording = Recording::read(bag, None).expect("a recording");
    recording.why(&|_| {}, &Arc::new(AtomicBool::new(false))).expect("an answer")
}
