//! A process of a running graph is killed: what the hand feels, what remains, and what the bag still holds.

mod system;

use backdrive_bags::Reader;
use backdrive_msgs::{Sample, flag, measured};
use nix::sys::signal::Signal;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};
use system::assert_names;
use system::{Ended, Place, alone, events, graph_text, kill, samples, until, until_recorded};

/// Steps per second: slow enough for a busy machine with few processors.
const RATE: &str = "1000";
/// Steps that are bridged at that rate with `stale_after_s = 0.01`: the force begins to decay at the next one, and is zero as many steps later.
const HOLD: u64 = 9;
/// The hand pushes the wall from 0.95 s to 3 s.
const KILLED_AFTER: u64 = 1300;
/// By how many steps a node may have been behind its peers when it died, on a machine that withholds its processors:
/// beyond it a node skips.
const BEHIND: u64 = 250;

fn unix_ns() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as i64
}

struct Killed {
    done: Ended,
    bag: PathBuf,
    runs: Vec<String>,
    at_ns: i64,
}

fn start(place: &Place, graph: &str, duration: &str) -> (system::Running, PathBuf) {
    let graph = place.write("graph.toml", graph).display().to_string();
    let options = ["--clock", "realtime", "--rate", RATE, "--duration", duration, "--bag", "run.mcap", "--json"];
    let run = place.start(&[&["run", graph.as_str()], &options[..]].concat());
    let bag = place.path("run.mcap");
    until_recorded(&bag, "/master/measured_js", KILLED_AFTER);
    (run, bag)
}

/// Runs the contact task in real time, kills a node during the push, and waits for the end.
fn killed(place: &Place, node: &str) -> Killed {
    let (run, bag) = start(place, &graph_text("launch/contact.toml"), "2.2");
    let runs = place.runs();
    assert_eq!((runs.len(), place.processes().len()), (1, 6));
    let pid = place.process(node).unwrap();
    let at_ns = unix_ns();
    kill(pid, Signal::SIGKILL);
    let done = run.end();
    assert_eq!(done.code, Some(6), "{done:?}");
    assert!(done.stderr.contains(&format!("`{node}` was killed by signal 9 (SIGKILL)")), "{done:?}");
    place.assert_clean(&runs);
    Killed { done, bag, runs, at_ns }
}

fn last_step(bag: &Path, topic: &str, counts: impl Fn(&Sample) -> bool) -> u64 {
    samples(bag, topic).iter().filter(|s| counts(s)).map(|s| s.step).max().unwrap()
}

/// The force on the master after the last sample of the killed node: held, decaying, zero. `extra`: steps that the news
/// takes along the loop.
fn assert_decay(node: &str, killed: &Killed, last: u64, kind: &str, extra: u64) {
    let told = events(&killed.bag, "master");
    let (start, what, value) = told.iter().rev().find(|(_, what, _)| what.starts_with("force_")).unwrap();
    let start = *start;
    assert_eq!(what, kind, "{told:?}");
    if kind == "force_stale" {
        assert_eq!(*value, (HOLD + 1) as f64, "steps without a force, by the master's own count");
    }
    let rows = samples(&killed.bag, "/master/measured_js");
    let held = rows.iter().rfind(|s| s.step < start).unwrap().effort[0];
    assert!(held < -0.3, "the wall was not felt: {held} N");
    // A slave that lives still reports what it feels, so the force that decays is not quite the one before.
    let slack = if kind == "force_outdated" { 0.05 * held.abs() } else { 1e-9 };
    for row in rows.iter().filter(|s| s.step >= start) {
        let down = row.step - start + 1;
        let most = held.abs() * (1.0 - down as f64 / HOLD as f64).max(0.0);
        assert!(
            row.effort[0].abs() <= if most > 0.0 { most + slack } else { 0.0 },
            "step {}: {} N, {down} steps after {held} N",
            row.step,
            row.effort[0]
        );
        assert!(row.flags & flag::STALE != 0, "step {} is not flagged", row.step);
    }
    let zero = rows.iter().find(|s| s.step >= start && s.effort[0] == 0.0).unwrap().step;
    println!(
        "{node}: last sample at step {last}, decay from {} steps after it, zero {} steps after it; held {held:.3} N",
        start - last,
        zero - last
    );
    // With a step of delay in the loop, and one of waiting, within 20 ms.
    assert!(zero - start < HOLD, "the force is gone {} steps after its decay began", zero - start);
    assert!(start - last > HOLD, "the force decayed too early");
    assert!(start - last <= HOLD + 1 + extra + BEHIND, "the force decayed too late");
    assert!(rows.iter().any(|s| s.step >= zero + HOLD), "the master did not go on");
}

fn assert_slave_holds(killed: &Killed) {
    let told = events(&killed.bag, "slave");
    let (start, what, value) = told.last().unwrap();
    assert_eq!((what.as_str(), *value), ("slave_holds", (HOLD + 1) as f64), "{told:?}");
    let rows = samples(&killed.bag, "/slave/measured_js");
    let after: Vec<&Sample> = rows.iter().filter(|s| s.step >= *start).collect();
    assert!(after.iter().all(|s| s.flags & flag::STALE != 0));
    let settled: Vec<f64> = after.iter().skip(after.len() / 2).map(|s| s.position[0]).collect();
    let (low, high) = settled.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    assert!(settled.len() > 100 && high - low < 1e-6, "the slave moved by {} m while it should hold", high - low);
}

fn assert_complete_until_the_end(killed: &Killed) {
    let report = killed.done.json();
    assert_eq!((&report["lost"], &report["complete"]), (&0.into(), &true.into()), "{:?}", killed.done);
    assert_eq!(report["steps"], 2200);
    assert_eq!(report["run"]["deaths"][0]["signal"], 9);
    assert_eq!(killed.runs.len(), 1);
}

#[test]
fn slave() {
    let (_alone, place) = (alone(), Place::new());
    let killed = killed(&place, "slave");
    assert_complete_until_the_end(&killed);
    assert_decay("slave", &killed, last_step(&killed.bag, "/slave/measured_js", |_| true), "force_stale", 1);
}

#[test]
fn scaling() {
    let (_alone, place) = (alone(), Place::new());
    let killed = killed(&place, "scaling");
    assert_complete_until_the_end(&killed);
    let last = last_step(&killed.bag, "/master/servo_jf", |s| measured(s.effort[0]).is_some());
    assert_decay("scaling", &killed, last, "force_stale", 0);
    assert_slave_holds(&killed);
}

#[test]
fn canceller() {
    let (_alone, place) = (alone(), Place::new());
    let killed = killed(&place, "canceller");
    assert_complete_until_the_end(&killed);
    // The slave still feels the wall, but what it does is no longer what the hand does.
    assert_decay("canceller", &killed, last_step(&killed.bag, "/canceller/measured_js", |_| true), "force_outdated", 1);
    assert_slave_holds(&killed);
}

#[test]
fn master() {
    let (_alone, place) = (alone(), Place::new());
    let killed = killed(&place, "master");
    assert_complete_until_the_end(&killed);
    assert_slave_holds(&killed);
}

#[test]
fn operator() {
    let (_alone, place) = (alone(), Place::new());
    let killed = killed(&place, "operator");
    assert_complete_until_the_end(&killed);
    // A hand that gives no more news rests where it was; the loop goes on.
    let rows = samples(&killed.bag, "/master/measured_js");
    let (last, end) = (last_step(&killed.bag, "/operator/setpoint_js", |_| true), rows.last().unwrap());
    assert!(end.step > last + 300 && end.effort[0] < -0.3 && end.flags & flag::STALE == 0, "{last} {end:?}");
    // A machine that stalls may make the slave hold for a moment; it follows again.
    let told = events(&killed.bag, "slave");
    let last = told.iter().rev().find(|(_, kind, _)| kind == "slave_holds" || kind == "slave_follows");
    assert!(last.is_none_or(|(_, kind, _)| kind == "slave_follows"), "{told:?}");
}

/// Time from the last sample in a bag, once recovered, to a moment, s.
fn lost_before(place: &Place, bag: &Path, at_ns: i64, name: &str) -> f64 {
    let saved = place.path(name);
    let done = place.backdrive(&["bag", "recover", &bag.display().to_string(), "--bag", name]);
    // A recorder that was killed leaves an end that is lost; one that outlives its supervisor closes the bag.
    let closed = Reader::open(bag).unwrap().ended_cleanly();
    assert_eq!(done.code, Some(if closed { 0 } else { 4 }), "{done:?}");
    let reader = Reader::open(&saved).unwrap();
    assert!(reader.ended_cleanly() && reader.header().is_some() && reader.damage().is_empty());
    let rows = samples(&saved, "/master/measured_js");
    assert!(rows.windows(2).all(|w| w[1].sequence == w[0].sequence + 1), "a hole inside");
    // What was recovered can be used.
    let replayed = place.backdrive(&["replay", name, "--json"]);
    assert!(matches!(replayed.code, Some(0 | 1 | 7)), "{replayed:?}");
    (at_ns - rows.last().unwrap().stamp_ns) as f64 * 1e-9
}

fn median(mut values: [f64; 3]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[1]
}

#[test]
fn recorder() {
    let _alone = alone();
    let lost = [0, 1, 2].map(|_| {
        let place = Place::new();
        let killed = killed(&place, "recorder");
        // What is not recorded is lost for good: the run does not go on without it.
        assert!(killed.done.json()["steps"].as_u64().unwrap() < 2200);
        assert_eq!(killed.done.json()["complete"], false);
        assert!(!Reader::open(&killed.bag).unwrap().ended_cleanly());
        lost_before(&place, &killed.bag, killed.at_ns, "saved.mcap")
    });
    println!("recorder: the bag ends {lost:.3?} s before the kill");
    assert!(median(lost) < 0.25, "{lost:?}");
}

#[test]
fn supervisor() {
    let _alone = alone();
    let lost = [0, 1, 2].map(|_| {
        let place = Place::new();
        let (mut run, bag) = start(&place, &graph_text("launch/contact.toml"), "60");
        let runs = place.runs();
        assert_eq!((runs.len(), place.processes().len()), (1, 6));
        let at_ns = unix_ns();
        run.child.kill().unwrap();
        run.child.wait().unwrap();
        let begun = std::time::Instant::now();
        until("the nodes to be gone", || place.processes().is_empty());
        let gone_s = begun.elapsed().as_secs_f64();
        // The last of them has removed what the run had.
        place.assert_clean(&runs);
        let lost = lost_before(&place, &bag, at_ns, "saved.mcap");
        let next = place.backdrive(&["run", "graph.toml", "--duration", "0.1", "--bag", "next.mcap"]);
        assert_eq!(next.code, Some(7), "{next:?}");
        assert!(!next.stderr.contains("had left"), "{next:?}");
        (lost, gone_s)
    });
    let (lost, gone) = (lost.map(|l| l.0), lost.map(|l| l.1));
    println!("supervisor: the bag ends {lost:.3?} s before the kill, and the nodes are gone {gone:.3?} s after it");
    assert!(median(lost) < 0.25, "{lost:?}");
    assert!(median(gone) < 1.0, "{gone:?}");
}

#[test]
fn a_slave_that_is_started_again_brings_the_force_back() {
    let (_alone, place) = (alone(), Place::new());
    let graph = graph_text("launch/contact.toml").replace("kind = \"slave\"\n", "kind = \"slave\"\nrestart = true\n");
    let (run, bag) = start(&place, &graph, "2.9");
    let runs = place.runs();
    let first = place.process("slave").unwrap();
    kill(first, Signal::SIGKILL);
    until("another slave", || place.process("slave").is_some_and(|pid| pid != first));
    let done = run.end();
    // A run that a node was away from is not called stable.
    assert_eq!(done.code, Some(7), "{done:?}");
    assert_names(&done.stderr, &["`slave`"]);
    let report = done.json();
    assert_eq!((&report["run"]["deaths"][0]["recovered"], &report["lost"], &report["complete"]), (&true.into(), &0.into(), &true.into()));
    let told: Vec<String> = events(&bag, "master").into_iter().map(|(_, kind, _)| kind).collect();
    assert!(told.iter().any(|k| k == "force_stale") && told.last().is_some_and(|k| k == "force_back"), "{told:?}");
    let rows = samples(&bag, "/master/measured_js");
    assert!(rows.iter().any(|s| s.step > KILLED_AFTER && s.effort[0] == 0.0), "the force never went away");
    let end = rows.last().unwrap();
    assert!(end.effort[0] < -0.3 && end.flags & flag::STALE == 0, "the force is not back: {} N", end.effort[0]);
    place.assert_clean(&runs);
}

/// Two nodes in one process die together and come back together; each reports this itself.
#[test]
fn nodes_together_in_a_process_come_back_together() {
    let (_alone, place) = (alone(), Place::new());
    let mut graph = format!("together = [\"scaling\", \"canceller\"]\n{}", graph_text("launch/contact.toml"));
    for kind in ["scaling", "canceller"] {
        graph = graph.replace(&format!("kind = \"{kind}\"\n"), &format!("kind = \"{kind}\"\nrestart = true\n"));
    }
    let (run, bag) = start(&place, &graph, "2.9");
    let runs = place.runs();
    assert_eq!(place.processes().len(), 5);
    let first = place.process("scaling").unwrap();
    kill(first, Signal::SIGKILL);
    until("another process", || place.process("scaling").is_some_and(|pid| pid != first));
    let done = run.end();
    assert_eq!(done.code, Some(7), "{done:?}");
    assert_names(&done.stderr, &["`scaling+canceller`"]);
    let report = done.json();
    let death = &report["run"]["deaths"][0];
    assert_eq!((&death["node"], &death["recovered"], &report["lost"]), (&"scaling+canceller".into(), &true.into(), &0.into()));
    for (name, other) in [("scaling", "canceller"), ("canceller", "scaling")] {
        let node = report["run"]["nodes"].as_array().unwrap().iter().find(|n| n["name"] == name).unwrap();
        assert_eq!((&node["restarts"], &node["with"][0]), (&1.into(), &other.into()), "{node}");
        let told: Vec<String> = events(&bag, name).into_iter().map(|(_, kind, _)| kind).collect();
        assert!(told.iter().any(|k| k == "joined_late"), "{name}: {told:?}");
    }
    place.assert_clean(&runs);
}

/// No node dies, but next to nothing comes through: staleness travels along the loop in lockstep too.
#[test]
fn a_connection_that_fails_lets_the_force_go() {
    let place = Place::new();
    let text = graph_text("launch/contact.toml");
    let broken = text.replace("to = \"scaling.motion\"\n", "to = \"scaling.motion\"\nimpair = { loss = 0.97 }\n");
    assert_ne!(text, broken);
    let graph = place.write("graph.toml", &broken).display().to_string();
    let done = place.backdrive(&["run", &graph, "--transport", "inproc", "--rate", RATE, "--bag", "run.mcap"]);
    assert!(matches!(done.code, Some(0 | 1 | 7)), "{done:?}");
    let bag = place.path("run.mcap");
    let told = events(&bag, "master");
    let (gone, back): (Vec<_>, Vec<_>) = told.iter().partition(|(_, kind, _)| kind == "force_outdated");
    assert!(gone.len() > 10 && back.len() + 1 >= gone.len() && back.iter().all(|(_, kind, _)| kind == "force_back"), "{told:?}");
    let holds: Vec<u64> = events(&bag, "slave").iter().filter(|(_, kind, _)| kind == "slave_holds").map(|(step, ..)| *step).collect();
    // The slave's news is a step late, as the contact force is.
    assert!(gone.iter().all(|(step, ..)| holds.contains(&(step - 1))), "{gone:?} {holds:?}");
    let (rows, contact) = (samples(&bag, "/master/measured_js"), samples(&bag, "/slave/measured_js"));
    let mut stale = 0;
    for k in 1..rows.len() {
        stale = if contact[k - 1].flags & flag::STALE != 0 { stale + 1 } else { 0 };
        let most = 0.3 * contact[k - 1].effort[0].abs() * (1.0 - stale as f64 / HOLD as f64).max(0.0);
        assert!(stale == 0 || rows[k].effort[0].abs() <= most + 1e-9, "step {k}: {} N after {stale} stale steps", rows[k].effort[0]);
    }
}

#[test]
fn in_lockstep_the_run_ends_with_the_node() {
    for node in ["slave", "operator", "recorder"] {
        let place = Place::new();
        let graph = place.write("graph.toml", &graph_text("launch/contact.toml")).display().to_string();
        let run = place.start(&["run", &graph, "--duration", "3000", "--bag", "run.mcap", "--json"]);
        let bag = place.path("run.mcap");
        until_recorded(&bag, "/master/measured_js", 2000);
        let runs = place.runs();
        kill(place.process(node).unwrap(), Signal::SIGKILL);
        let begun = std::time::Instant::now();
        let done = run.end();
        // Not by the peers' patience, which is 10 s.
        assert!(begun.elapsed().as_secs_f64() < 8.0, "{node}: {done:?}");
        assert_eq!(done.code, Some(6), "{done:?}");
        assert!(
            done.stderr.contains(&format!("`{node}` was killed by signal 9 (SIGKILL)")) && done.stderr.contains("the run stops"),
            "{done:?}"
        );
        place.assert_clean(&runs);
        let complete = done.json()["complete"] == true;
        assert_eq!(complete, node != "recorder", "{done:?}");
        // What was recorded up to then is the run, exactly.
        let replayed = place.backdrive(&["replay", "run.mcap", "--bag", "again.mcap"]);
        assert!(matches!(replayed.code, Some(0 | 1 | 7)), "{replayed:?}");
        let (was, again) = (samples(&bag, "/master/measured_js"), samples(&place.path("again.mcap"), "/master/measured_js"));
        assert!(was.len() >= 2000 && was.iter().zip(&again).all(|(a, b)| a.same_bits(b)), "{node}: {} steps", was.len());
    }
}
