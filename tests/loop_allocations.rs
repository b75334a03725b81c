//! The loop in one thread is stepped without asking for memory: operator, master, canceller, scaling and slave of the contact task, and of an arm's loop.

use backdrive_nodes::build::plan;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides};
use backdrive_nodes::sequence::Sequence;
use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

static ASKED: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call is handed to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ASKED.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

// One test: others in this program would be counted too.
#[test]
fn a_loop_allocates_nothing_while_it_runs() {
    for (file, steps) in [("launch/contact.toml", 10_000), ("launch/leader-follower.toml", 1000)] {
        let graph = Graph::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(file), &Overrides::default()).unwrap();
        let plans = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder).map(|n| plan(&graph, &n.name).unwrap()).collect();
        let mut sequence = Sequence::new(plans, &graph.timing).unwrap();
        // The first step starts the devices.
        sequence.run(1, None);
        let before = ASKED.load(Ordering::Relaxed);
        sequence.run(steps, None);
        assert_eq!(ASKED.load(Ordering::Relaxed) - before, 0, "{file}");
    }
}
