//! The loop in one thread is stepped without asking for memory: operator, master, canceller, scaling and slave of the contact task, and of an arm's loop.

#[path = "../plant/tests/counting/mod.rs"]
mod counting;

use backdrive_nodes::build::plan;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides};
use backdrive_nodes::sequence::Sequence;
use std::path::Path;

#[test]
fn a_loop_allocates_nothing_while_it_runs() {
    for (file, steps) in [("launch/contact.toml", 10_000), ("launch/leader-follower.toml", 1000)] {
        let graph = Graph::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(file), &Overrides::default()).unwrap();
        let plans = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder).map(|n| plan(&graph, &n.name).unwrap()).collect();
        let mut sequence = Sequence::new(plans, &graph.timing).unwrap();
        // The first step starts the devices.
        sequence.run(1, None);
        assert_eq!(counting::asked(|| sequence.run(steps, None)), 0, "{file}");
    }
}
