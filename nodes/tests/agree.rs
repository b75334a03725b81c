//! The same graph over threads, over processes with shared memory, and in one thread gives the same
//! messages, bit for bit.

mod common;

use backdrive_nodes::clock::Start;
use backdrive_nodes::process::{ProcessOptions, run_process};
use backdrive_nodes::protocol::{FromNode, ToNode};
use backdrive_nodes::recorder::RunningRecorder;
use backdrive_nodes::runner::{Control, Options, Runner};
use backdrive_nodes::sequence::Sequence;
use backdrive_nodes::stage::{Clock, Impairment, Timing};
use backdrive_nodes::transport::Location;
use backdrive_nodes::transport::iceoryx2::Iceoryx2;
use backdrive_nodes::transport::inproc::Hub;
use common::*;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

const STEPS: u64 = 20_000;

fn bad_line() -> Impairment {
    Impairment { delay_s: 0.005, jitter_s: 0.003, loss: 0.05, seed: 42 }
}

fn lockstep() -> Timing {
    timing(Clock::Lockstep, 1000.0, Some(STEPS))
}

fn in_one_thread(impairment: Option<Impairment>) -> Heard {
    let mut sequence = Sequence::new(plans(impairment, true), &lockstep()).unwrap();
    let names: Vec<String> = recorder_plan().topics.into_iter().map(|t| t.name).collect();
    let place: Vec<usize> = sequence.topics().iter().map(|t| names.iter().position(|n| *n == t.name).unwrap()).collect();
    let mut heard = vec![Vec::new(); names.len()];
    sequence.run(STEPS, Some(&mut |topic, message| heard[place[topic]].push(bits(message))));
    heard
}

fn in_threads(impairment: Option<Impairment>) -> Heard {
    in_threads_of(&NODES.map(|name| vec![name]), impairment)
}

/// A thread for each of these groups of nodes.
fn in_threads_of(groups: &[Vec<&str>], impairment: Option<Impairment>) -> Heard {
    let hub = Hub::default();
    let (keeping, heard) = Keeping::new(recorder_plan().topics.len());
    let mut recording = RunningRecorder::new(&recorder_plan(), &lockstep(), Box::new(hub.join()), Box::new(keeping)).unwrap();
    let barrier = Arc::new(std::sync::Barrier::new(groups.len()));
    std::thread::scope(|scope| {
        for group in groups {
            let plan_of = |name: &&str| plans(impairment, true).into_iter().find(|p| p.name == *name).unwrap();
            let plans: Vec<_> = group.iter().map(plan_of).collect();
            let (hub, barrier) = (hub.clone(), Arc::clone(&barrier));
            scope.spawn(move || {
                let options = Options { listeners: listeners(true), ..Options::default() };
                let mut runner = Runner::together(plans, &lockstep(), Box::new(hub.join()), options).unwrap();
                barrier.wait();
                assert_eq!(runner.missing(), Vec::<String>::new());
                let reports = runner.run(Start::after(0), &Arc::new(Control::default()), &mut |_| {}).unwrap();
                assert_eq!(reports.len(), group.len());
                reports.iter().for_each(|status| assert_eq!((status.steps, status.lost), (STEPS, 0)));
            });
        }
        recording.run(Start::after(0), Some(STEPS), || false, &mut |_| {}).unwrap();
    });
    recording.finish().unwrap();
    Arc::try_unwrap(heard).unwrap().into_inner().unwrap()
}

/// Not a test of its own: what the processes below run.
#[test]
fn child() {
    let Ok(name) = std::env::var("BACKDRIVE_TEST_NODE") else { return };
    let get = |key: &str| std::env::var(key).unwrap();
    let location: Location = serde_json::from_str(&get("BACKDRIVE_TEST_LOCATION")).unwrap();
    let impairment = serde_json::from_str(&get("BACKDRIVE_TEST_IMPAIRMENT")).unwrap();
    let plan = plans(impairment, true).into_iter().find(|p| p.name == name).unwrap();
    let transport = Box::new(Iceoryx2::open(&location, &name).unwrap());
    let options = ProcessOptions { run: Options { listeners: listeners(true), ..Options::default() }, ..ProcessOptions::default() };
    run_process(plan, &lockstep(), transport, options);
}

struct Process {
    child: Child,
    lines: BufReader<std::process::ChildStdout>,
}

impl Process {
    fn start(name: &str, location: &Location, impairment: Option<Impairment>) -> Process {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "child", "--nocapture", "--test-threads=1"])
            .env("BACKDRIVE_TEST_NODE", name)
            .env("BACKDRIVE_TEST_LOCATION", serde_json::to_string(location).unwrap())
            .env("BACKDRIVE_TEST_IMPAIRMENT", serde_json::to_string(&impairment).unwrap())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap());
        Process { child, lines }
    }

    fn next(&mut self) -> FromNode {
        loop {
            let mut line = String::new();
            assert!(self.lines.read_line(&mut line).unwrap() > 0, "the process has ended");
            // The test harness of the child writes on the same line.
            if let Some(message) = line.find('{').and_then(|at| serde_json::from_str(&line[at..]).ok()) {
                return message;
            }
        }
    }

    fn say(&mut self, message: &ToNode) {
        let mut line = serde_json::to_vec(message).unwrap();
        line.push(b'\n');
        self.child.stdin.as_mut().unwrap().write_all(&line).unwrap();
    }
}

fn in_processes(impairment: Option<Impairment>) -> Heard {
    let root = tempfile::tempdir().unwrap();
    let prefix = format!("agree{}_{}_", std::process::id(), u8::from(impairment.is_some()));
    let location = Location { prefix, root: root.path().join("run") };
    let (keeping, heard) = Keeping::new(recorder_plan().topics.len());
    let transport = Box::new(Iceoryx2::open(&location, "recorder").unwrap());
    let mut recording = RunningRecorder::new(&recorder_plan(), &lockstep(), transport, Box::new(keeping)).unwrap();
    let mut processes: Vec<Process> = NODES.iter().map(|name| Process::start(name, &location, impairment)).collect();
    for process in &mut processes {
        assert_eq!(process.next(), FromNode::Created);
        loop {
            match process.next() {
                FromNode::Ready => break,
                FromNode::Waiting { missing } => eprintln!("{missing:?}"),
                other => panic!("{other:?}"),
            }
        }
    }
    while !recording.missing().is_empty() {
        std::thread::sleep(Duration::from_millis(1));
    }
    let start = Start::after(0);
    let Start { t0_ns, unix_ns } = start;
    processes.iter_mut().for_each(|p| p.say(&ToNode::Start { t0_ns, unix_ns }));
    recording.run(start, Some(STEPS), || false, &mut |_| {}).unwrap();
    recording.finish().unwrap();
    for process in &mut processes {
        let mut events = 0;
        let status = loop {
            match process.next() {
                FromNode::Done(status) => break status,
                FromNode::Event { kind, .. } => events += u64::from(kind == "toy_event"),
                FromNode::Status(_) => {}
                other => panic!("{other:?}"),
            }
        };
        assert_eq!((status.steps, status.lost, events >= STEPS / 997), (STEPS, 0, true));
        assert!(process.child.wait().unwrap().success());
    }
    location.remove().unwrap();
    Arc::try_unwrap(heard).unwrap().into_inner().unwrap()
}

fn assert_same(a: &Heard, b: &Heard, what: &str) {
    for ((a, b), topic) in a.iter().zip(b).zip(recorder_plan().topics) {
        if let Some(at) = a.iter().zip(b).position(|(a, b)| a != b) {
            panic!("{what}: {} differs first at message {at}:\n{}\n{}", topic.name, a[at], b[at]);
        }
        assert_eq!(a.len(), b.len(), "{what}: {}", topic.name);
        if topic.kind == backdrive_msgs::topic::Kind::Sample {
            assert_eq!(a.len() as u64, STEPS, "{what}: {}", topic.name);
        }
        assert!(!a.is_empty(), "{what}: {}", topic.name);
    }
}

#[test]
fn nodes_that_share_a_thread_agree() {
    let ways: [&[&[&str]]; 3] = [
        &[&["scaling", "canceller"], &["operator"], &["master"], &["slave"]],
        &[&["operator", "master"], &["slave", "scaling"], &["canceller"]],
        &[&["slave", "scaling", "canceller", "master", "operator"]],
    ];
    for impairment in [None, Some(bad_line())] {
        let whole = in_one_thread(impairment);
        for groups in ways {
            let groups: Vec<Vec<&str>> = groups.iter().map(|g| g.to_vec()).collect();
            assert_same(&whole, &in_threads_of(&groups, impairment), "nodes together");
        }
    }
}

#[test]
fn threads_and_one_thread_agree() {
    for impairment in [None, Some(bad_line())] {
        assert_same(&in_one_thread(impairment), &in_threads(impairment), "threads");
    }
}

#[test]
fn processes_and_one_thread_agree() {
    for impairment in [None, Some(bad_line())] {
        assert_same(&in_one_thread(impairment), &in_processes(impairment), "processes");
    }
}

#[test]
fn the_comparison_can_fail() {
    let (good, bad) = (in_one_thread(None), in_one_thread(Some(Impairment { seed: 43, ..bad_line() })));
    assert!(good.iter().zip(&bad).any(|(a, b)| a != b));
    assert_ne!(in_one_thread(Some(bad_line())), bad, "another seed is another run");
}
