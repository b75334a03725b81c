//! How a node behaves when its peers do not: both clocks, over threads and over processes.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod common;

use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_msgs::Sample;
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_nodes::clock::Start;
use backdrive_nodes::process::{ProcessOptions, run_process};
use backdrive_nodes::protocol::{FromNode, NodeStatus, ToNode};
use backdrive_nodes::realtime;
use backdrive_nodes::runner::{Control, Options, RunError, Runner, Told};
use backdrive_nodes::stage::{Clock, NodePlan, Timing};
use backdrive_nodes::transport::iceoryx2::Iceoryx2;
use backdrive_nodes::transport::inproc::Hub;
use backdrive_nodes::transport::{Location, Transport};
use common::{Toy, input, node, stage, timing};
use naming::assert_names;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// What a port held, step by step: (step, step of the sample, age).
type Seen = Arc<Mutex<Vec<(u64, Option<u64>, u64)>>>;

struct Watching(Seen);

impl Core for Watching {
    fn step(&mut self, tick: &Tick, inputs: &[Port], _: &mut [Sample], _: &mut Events) {
        self.0.lock().unwrap().push((tick.step, inputs[0].sample.map(|s| s.step), inputs[0].age_steps));
    }
}

/// Holds its whole process up once.
struct Sleeping {
    at: u64,
    how_long: Duration,
}

impl Core for Sleeping {
    fn step(&mut self, tick: &Tick, _: &[Port], _: &mut [Sample], _: &mut Events) {
        if tick.step == self.at {
            std::thread::sleep(self.how_long);
        }
    }
}

fn watcher(seen: &Seen, delay: u64) -> NodePlan {
    node("watcher", vec![stage("watch", Watching(Arc::clone(seen)), vec![input("in", "/source/out", delay)], &[])])
}

fn source() -> NodePlan {
    node("source", vec![stage("source", Toy::new(0.3), vec![], &["/source/out"])])
}

fn runner(hub: &Hub, plan: NodePlan, timing: &Timing) -> Runner {
    Runner::new(plan, timing, Box::new(hub.join()), Options::default()).unwrap()
}

/// Runs a node, and collects the kinds and numbers of its events.
fn run(runner: &mut Runner, start: Start, control: &Arc<Control>) -> (Result<NodeStatus, RunError>, Vec<(String, f64)>) {
    let mut events = Vec::new();
    let result = runner.run(start, control, &mut |told| {
        if let Told::Event(e) = told {
            events.push((e.kind.as_str().to_string(), e.value));
        }
    });
    (result.map(|reports| reports[0]), events)
}

#[test]
fn a_lockstep_run_ends_when_a_peer_is_missing_and_names_it() {
    let (hub, seen) = (Hub::default(), Seen::default());
    let timing = Timing { peer_timeout_s: 0.2, ..timing(Clock::Lockstep, 1000.0, Some(100)) };
    let mut events = hub.join();
    let mut events = events.subscriber(&Topic { name: "/watcher/events".into(), kind: Kind::Event }, 16, false).unwrap();
    let mut watcher = runner(&hub, watcher(&seen, 2), &timing);
    assert_eq!(watcher.missing(), ["/source/out: no publisher"]);
    let (result, told) = run(&mut watcher, Start::after(0), &Arc::default());
    match result {
        Err(e @ RunError::PeerTimeout { .. }) => assert_names(e.to_string(), &["step 2", "/source/out"]),
        other => panic!("{other:?}"),
    }
    assert_eq!(told[0].0, "peer_timeout");
    assert!(events.receive().unwrap().is_some(), "a recorder hears of it too");
    assert_eq!(*seen.lock().unwrap(), [(0, None, 0), (1, None, 0)]);
}

#[test]
fn a_lockstep_run_ends_when_a_sample_is_lost() {
    let (hub, seen) = (Hub::default(), Seen::default());
    // Five thousand steps of a source that nothing holds back do not fit into the watcher's queue.
    let timing = timing(Clock::Lockstep, 1000.0, Some(5000));
    let mut watcher = runner(&hub, watcher(&seen, 0), &timing);
    run(&mut runner(&hub, source(), &timing), Start::after(0), &Arc::default()).0.unwrap();
    match run(&mut watcher, Start::after(0), &Arc::default()).0 {
        Err(e @ RunError::Lost { .. }) => assert!(e.code() == 4 && e.to_string().contains("/source/out"), "{e}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn real_time_goes_on_without_a_peer_and_takes_its_successor_in() {
    let (hub, seen) = (Hub::default(), Seen::default());
    let timing = timing(Clock::Realtime, 500.0, Some(600));
    let start = Start::after(20_000_000);
    let mut watcher = runner(&hub, watcher(&seen, 0), &timing);
    let begun = Instant::now();
    std::thread::scope(|scope| {
        let peer = scope.spawn(|| {
            let control = Arc::new(Control::default());
            let stopper = Arc::clone(&control);
            scope.spawn(move || {
                std::thread::sleep(Duration::from_millis(300));
                stopper.stop();
            });
            let first = run(&mut runner(&hub, source(), &timing), start, &control).0.unwrap();
            std::thread::sleep(Duration::from_millis(300));
            let (second, events) = run(&mut runner(&hub, source(), &timing), start, &Arc::default());
            assert!(events.iter().any(|(kind, step)| kind == "joined_late" && *step as u64 > first.steps));
            second.unwrap()
        });
        let (status, _) = run(&mut watcher, start, &Arc::default());
        assert_eq!(status.unwrap().lost, 0, "a successor that counts from 0 is no loss");
        assert_eq!(peer.join().unwrap().steps, 600);
    });
    // 1.2 s of steps and what the machine withheld; a loop that waited in vain each time would need far more.
    assert!(begun.elapsed() >= Duration::from_millis(1200));
    let seen = seen.lock().unwrap();
    let skipped = seen.iter().zip(0..).filter(|(s, i)| s.0 != *i).count();
    assert!(skipped > 0 || seen.len() == 600);
    let oldest = seen.iter().map(|s| s.2).max().unwrap();
    assert!((50..600).contains(&oldest), "the age grew to {oldest} steps");
    // Heard to the end: a sample that is some steps late on a busy machine is no loss. The last report of the first one is some 150.
    assert!(seen.last().unwrap().1.is_some_and(|held| held >= 500), "{:?}", seen.last());
    for (step, held, age) in seen.iter() {
        assert_eq!(*age, held.map_or(step + 1, |held| step - held));
    }
}

/// One process, two stages: what holds one up holds up both, as a machine that stands still does.
fn held_up(how_long: Duration) -> (Seen, NodeStatus, Vec<(String, f64)>) {
    let (hub, seen) = (Hub::default(), Seen::default());
    let timing = timing(Clock::Realtime, 500.0, Some(400));
    let sleeper = stage("sleep", Sleeping { at: 100, how_long }, vec![], &["/source/out"]);
    let watcher = stage("watch", Watching(Arc::clone(&seen)), vec![input("in", "/source/out", 0)], &[]);
    let mut runner = runner(&hub, node("both", vec![sleeper, watcher]), &timing);
    let (status, events) = run(&mut runner, Start::after(10_000_000), &Arc::default());
    (seen, status.unwrap(), events)
}

#[test]
fn late_steps_are_all_done_and_in_the_order_of_data() {
    let (seen, status, events) = held_up(Duration::from_millis(100));
    let seen = seen.lock().unwrap();
    if events.iter().any(|(kind, _)| kind == "steps_skipped") {
        return; // The machine itself stood still for longer than the horizon.
    }
    assert_eq!(seen.len(), 400);
    assert!(seen.iter().all(|(step, held, age)| *held == Some(*step) && *age == 0), "no step went without its own input");
    assert!(status.missed_deadlines >= 48, "{status:?}");
}

#[test]
fn beyond_the_horizon_steps_are_skipped_and_told() {
    let (seen, status, events) = held_up(Duration::from_millis(400));
    let seen = seen.lock().unwrap();
    let skipped: f64 = events.iter().filter(|(kind, _)| kind == "steps_skipped").map(|e| e.1).sum();
    // Each of the two stages skips for itself.
    assert!(skipped >= 2.0 * 120.0, "{events:?}");
    assert!(seen.len() < 400 && seen.last().unwrap().0 == 399);
    assert!(status.missed_deadlines >= skipped as u64);
}

#[test]
fn gains_arrive_and_are_told() {
    let hub = Hub::default();
    let timing = timing(Clock::Realtime, 1000.0, Some(300));
    let mut gains = hub.join();
    let mut gains = gains.subscriber(&Topic { name: "/scaling/gains".into(), kind: Kind::Gains }, 16, false).unwrap();
    let plan = node("scaling", vec![stage("scale", Toy::with_gains(0.3), vec![], &["/source/out"])]);
    let mut runner = runner(&hub, plan, &timing);
    let control = Arc::new(Control::default());
    control.set_gains(f64::NAN, 9.0, 0.0);
    let later = Arc::clone(&control);
    std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(100));
        later.set_gains(1.0, 0.5, 0.0);
    });
    run(&mut runner, Start::after(0), &control).0.unwrap();
    let told: Vec<f64> = std::iter::from_fn(|| gains.receive().unwrap())
        .map(|m| if let backdrive_msgs::Message::Gains(g) = m { g.lambda } else { f64::NAN })
        .collect();
    assert_eq!(told, [1.0, 0.5], "at step 0, at the change, and gains that are no numbers are ignored");
}

/// Not a test of its own: the process that is stopped and orphaned below.
#[test]
fn child() {
    let Ok(location) = std::env::var("BACKDRIVE_TEST_LOCATION") else { return };
    let location: Location = serde_json::from_str(&location).unwrap();
    let transport = Box::new(Iceoryx2::open(&location, "source").unwrap());
    let realtime = realtime::Options { priority: None, lock_memory: true, processors: vec![] };
    run_process(source(), &slow(), transport, ProcessOptions { realtime, ..ProcessOptions::default() });
}

fn slow() -> Timing {
    timing(Clock::Realtime, 500.0, Some(500))
}

fn start_child(location: &Location) -> (Child, BufReader<ChildStdout>) {
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "child", "--nocapture", "--test-threads=1"])
        .env("BACKDRIVE_TEST_LOCATION", serde_json::to_string(location).unwrap())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap());
    (child, lines)
}

fn next(lines: &mut BufReader<ChildStdout>) -> FromNode {
    loop {
        let mut line = String::new();
        assert!(lines.read_line(&mut line).unwrap() > 0, "the process has ended");
        if let Some(message) = line.find('{').and_then(|at| serde_json::from_str(&line[at..]).ok()) {
            return message;
        }
    }
}

fn location(name: &str) -> Location {
    let prefix = format!("{name}{}_", std::process::id());
    Location { root: std::env::temp_dir().join(&prefix), prefix }
}

#[test]
fn a_process_that_is_stopped_for_a_while_catches_up() {
    let place = location("stopped");
    let (mut child, mut lines) = start_child(&place);
    assert_eq!((next(&mut lines), next(&mut lines)), (FromNode::Created, FromNode::Ready));
    let seen = Seen::default();
    let transport: Box<dyn Transport> = Box::new(Iceoryx2::open(&place, "watcher").unwrap());
    let mut watcher = Runner::new(watcher(&seen, 0), &slow(), transport, Options::default()).unwrap();
    assert_eq!(watcher.missing(), Vec::<String>::new());
    let start = Start::after(20_000_000);
    let mut line = serde_json::to_vec(&ToNode::Start { t0_ns: start.t0_ns, unix_ns: start.unix_ns }).unwrap();
    line.push(b'\n');
    child.stdin.as_mut().unwrap().write_all(&line).unwrap();
    let pid = Pid::from_raw(child.id() as i32);
    std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(300));
        kill(pid, Signal::SIGSTOP).unwrap();
        std::thread::sleep(Duration::from_millis(120));
        kill(pid, Signal::SIGCONT).unwrap();
    });
    let (status, _) = run(&mut watcher, start, &Arc::default());
    assert_eq!(status.unwrap().lost, 0);
    let done = loop {
        if let FromNode::Done(status) = next(&mut lines) {
            break status;
        }
    };
    assert_eq!(done.steps, 500);
    assert!(done.missed_deadlines >= 50, "{done:?}");
    assert!(child.wait().unwrap().success());
    let oldest = seen.lock().unwrap().iter().map(|s| s.2).max().unwrap();
    assert!(oldest >= 30, "the watcher went on meanwhile: {oldest}");
    // The last may come too late for a watcher that did not wait for it.
    assert!(seen.lock().unwrap().last().unwrap().1 >= Some(490));
    drop(watcher);
    place.remove().unwrap();
}

#[test]
fn a_process_ends_with_its_supervisor() {
    for stopped in [false, true] {
        let place = location(if stopped { "orphan_a" } else { "orphan_b" });
        let (mut child, mut lines) = start_child(&place);
        assert_eq!((next(&mut lines), next(&mut lines)), (FromNode::Created, FromNode::Ready));
        if stopped {
            child.stdin.as_mut().unwrap().write_all(b"nonsense\n{\"say\":\"stop\"}\n").unwrap();
        } else {
            drop(child.stdin.take());
        }
        assert!(matches!(next(&mut lines), FromNode::Done(_)));
        assert!(child.wait().unwrap().success());
        place.remove().unwrap();
    }
}
