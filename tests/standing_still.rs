//! A process of a run stands still: the run ends in bounded time, with what was recorded, and names the process.

mod system;

use backdrive_bags::Reader;
use nix::sys::signal::Signal;
use std::time::{Duration, Instant};
use system::assert_names;
use system::{Place, Running, alone, graph_text, kill, until_recorded};

/// What a busy machine may add to any time that is promised.
const SLACK: Duration = Duration::from_secs(6);

fn start(place: &Place, duration: &str) -> Running {
    let graph = place.write("graph.toml", &graph_text("launch/contact.toml")).display().to_string();
    let run = place.start(&["run", &graph, "--clock", "realtime", "--rate", "500", "--duration", duration, "--bag", "run.mcap", "--json"]);
    until_recorded(&place.path("run.mcap"), "/master/measured_js", 200);
    run
}

/// A recorder that is stopped is continued at the planned end, and closes its bag.
#[test]
fn a_stopped_recorder_holds_a_run_up_no_longer_than_a_second() {
    let (_alone, place) = (alone(), Place::new());
    let begun = Instant::now();
    let run = start(&place, "2");
    let runs = place.runs();
    kill(place.process("recorder").unwrap(), Signal::SIGSTOP);
    let done = run.end();
    // It took 41 s for 3 s before it was looked at whether a process is stopped.
    assert!(begun.elapsed() < Duration::from_secs(2 + 3) + SLACK, "{:?}: {done:?}", begun.elapsed());
    assert_names(&done.stderr, &["`recorder`", "SIGSTOP"]);
    // Its buffers cover 4096 messages of a topic: it has all of them, or reports which are lost.
    assert!(matches!(done.code, Some(0 | 1 | 4 | 7)), "{done:?}");
    let reader = Reader::open(&place.path("run.mcap")).unwrap();
    assert!(reader.ended_cleanly() && reader.damage().is_empty(), "{done:?}");
    place.assert_clean(&runs);
}

/// Also where every process of the run stands still, so that none reports that it is done.
#[test]
fn a_run_of_which_every_process_is_stopped_ends() {
    let (_alone, place) = (alone(), Place::new());
    let begun = Instant::now();
    let run = start(&place, "2");
    let runs = place.runs();
    let nodes = place.processes();
    assert_eq!(nodes.len(), 6);
    nodes.iter().for_each(|node| kill(node.pid, Signal::SIGSTOP));
    let done = run.end();
    assert!(begun.elapsed() < Duration::from_secs(2 + 4) + SLACK, "{:?}: {done:?}", begun.elapsed());
    for node in &nodes {
        assert!(done.stderr.contains(&format!("`{}` had been stopped (SIGSTOP)", node.node)), "{done:?}");
    }
    // Nothing in the recording shows that the loop was closed to the end.
    assert!(matches!(done.code, Some(4 | 6 | 7)), "{done:?}");
    assert!(Reader::open(&place.path("run.mcap")).is_ok_and(|r| r.ended_cleanly()), "{done:?}");
    place.assert_clean(&runs);
}

/// One Ctrl-C ends a run in order although a process of it is stopped; one that is stopped again and again is killed.
#[test]
fn an_interrupt_ends_a_run_with_a_stopped_process() {
    let _alone = alone();
    for (node, again) in [("slave", false), ("recorder", false), ("recorder", true)] {
        let place = Place::new();
        let run = start(&place, "60");
        let runs = place.runs();
        let pid = place.process(node).unwrap();
        kill(pid, Signal::SIGSTOP);
        let begun = Instant::now();
        kill(run.pid(), Signal::SIGINT);
        if again {
            for _ in 0..400 {
                let _ = nix::sys::signal::kill(nix::unistd::Pid::from_raw(pid), Signal::SIGSTOP);
                std::thread::sleep(Duration::from_millis(5));
            }
        }
        let done = run.end();
        let most = Duration::from_secs(if again { 3 } else { 2 });
        assert!(begun.elapsed() < most + SLACK, "{node}: {:?}: {done:?}", begun.elapsed());
        assert!(done.stderr.contains(&format!("`{node}` had been stopped (SIGSTOP)")), "{done:?}");
        assert_eq!(done.code, Some(130), "{done:?}");
        // Between two stops it may have ended.
        let killed = done.json()["run"]["killed"].as_array().is_some_and(|k| !k.is_empty());
        assert!(again || !killed, "{done:?}");
        place.assert_clean(&runs);
        // Closed, or cut off and recoverable.
        let recovered = place.backdrive(&["bag", "recover", "run.mcap", "--bag", "saved.mcap"]);
        assert_eq!(recovered.code, Some(if killed { 4 } else { 0 }), "{recovered:?}");
    }
}

/// The second Ctrl-C kills at once, whatever stands still.
#[test]
fn a_second_interrupt_kills_at_once() {
    let (_alone, place) = (alone(), Place::new());
    let run = start(&place, "60");
    let runs = place.runs();
    place.processes().iter().for_each(|node| kill(node.pid, Signal::SIGSTOP));
    let begun = Instant::now();
    kill(run.pid(), Signal::SIGINT);
    kill(run.pid(), Signal::SIGINT);
    let done = run.end();
    assert!(begun.elapsed() < Duration::from_secs(1) + SLACK, "{:?}: {done:?}", begun.elapsed());
    assert_eq!(done.code, Some(130), "{done:?}");
    place.assert_clean(&runs);
}

/// In lockstep no step is done without the others: the run ends by the patience of the peers.
#[test]
fn in_lockstep_a_stopped_process_ends_the_run_by_the_patience_of_its_peers() {
    let place = Place::new();
    let text = format!("peer_timeout_s = 1.0\n{}", graph_text("launch/contact.toml"));
    let graph = place.write("graph.toml", &text).display().to_string();
    let run = place.start(&["run", &graph, "--duration", "3000", "--bag", "run.mcap", "--json"]);
    until_recorded(&place.path("run.mcap"), "/master/measured_js", 1000);
    let runs = place.runs();
    kill(place.process("slave").unwrap(), Signal::SIGSTOP);
    let begun = Instant::now();
    let done = run.end();
    assert!(begun.elapsed() < Duration::from_secs(1 + 3) + SLACK, "{:?}: {done:?}", begun.elapsed());
    assert_names(&done.stderr, &["`slave`", "SIGSTOP"]);
    assert!(matches!(done.code, Some(5 | 6)), "{done:?}");
    assert!(Reader::open(&place.path("run.mcap")).is_ok_and(|r| r.ended_cleanly()), "{done:?}");
    place.assert_clean(&runs);
}
