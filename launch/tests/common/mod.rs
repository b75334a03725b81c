//! Graphs of toy nodes.
#![allow(dead_code)] // each test file uses its part

use backdrive_launch::{Display, NodePlan, Place, Plan, RunHome, RunReport, SuperviseOptions};
use backdrive_nodes::stage::{Clock, Timing};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::time::{Duration, Instant};

pub type Outcome = Result<(), Box<dyn std::error::Error>>;

/// A toy node: its name and how it behaves.
pub fn toy(name: &str, behaviour: &str) -> NodePlan {
    let command = [env!("CARGO_BIN_EXE_toy-node")].into_iter().chain(behaviour.split_whitespace()).map(str::to_string).collect();
    NodePlan { name: name.to_string(), kind: name.to_string(), command: Some(command), ..NodePlan::default() }
}

pub fn restarting(name: &str, behaviour: &str) -> NodePlan {
    NodePlan { restart: true, ..toy(name, behaviour) }
}

pub fn recorder(behaviour: &str) -> NodePlan {
    NodePlan { records: true, ..toy("recorder", behaviour) }
}

pub fn plan(clock: Clock, steps: Option<u64>, nodes: Vec<NodePlan>) -> Plan {
    Plan {
        held: Vec::new(),
        title: "toys".to_string(),
        text: "title = \"toys\"\n".to_string(),
        timing: Timing { rate_hz: 1000.0, clock, steps, peer_timeout_s: 1.0 },
        bag: None,
        nodes,
        place: Place::default(),
        hosts: Vec::new(),
    }
}

/// Generous where a busy machine could be slow, short where a test waits for it on purpose.
pub fn options(home: &Path) -> SuperviseOptions {
    SuperviseOptions {
        home: RunHome::at(home),
        ready_timeout: Duration::from_secs(30),
        grace: Duration::from_millis(500),
        recorder_grace: Duration::from_secs(10),
        display: Display::Quiet,
        sweep_limit: Duration::from_secs(30),
        ..SuperviseOptions::default()
    }
}

/// Waits until something is so.
pub fn until(what: &str, mut is: impl FnMut() -> bool) -> Outcome {
    let deadline = Instant::now() + Duration::from_secs(60);
    while !is() {
        if Instant::now() > deadline {
            return Err(format!("waited too long until {what}").into());
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Ok(())
}

/// Processes that have this in their arguments and are not zombies.
pub fn processes_of(home: &Path) -> Vec<i32> {
    let home = home.to_string_lossy().into_owned();
    let Ok(entries) = std::fs::read_dir("/proc") else { return Vec::new() };
    let pids = entries.flatten().filter_map(|e| e.file_name().to_string_lossy().parse::<i32>().ok());
    pids.filter(|pid| {
        let arguments = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        String::from_utf8_lossy(&arguments).split('\0').any(|a| a.starts_with(&home))
    })
    .collect()
}

/// Files in shared memory of the runs that this home has or had, by their ids.
pub fn shm_of(ids: &[String]) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir("/dev/shm") else { return Vec::new() };
    let names = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned());
    names.filter(|n| ids.iter().any(|id| n.starts_with(&format!("bd{id}_")))).collect()
}

pub fn runs_in(home: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(home) else { return Vec::new() };
    entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect()
}

/// A supervisor as a process of its own.
pub fn supervisor(home: &Path, graph: &str) -> Result<Child, std::io::Error> {
    Command::new(env!("CARGO_BIN_EXE_toy-supervisor"))
        .arg(home)
        .args(graph.split_whitespace())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
}

/// Waits for the first status line: the run has started.
pub fn wait_for_start(child: &mut Child) -> Result<BufReader<ChildStderr>, Box<dyn std::error::Error>> {
    let mut errors = BufReader::new(child.stderr.take().ok_or("no stderr")?);
    let mut line = String::new();
    while errors.read_line(&mut line)? > 0 {
        if line.contains("lost 0") {
            return Ok(errors);
        }
        line.clear();
    }
    Err("it ended before it had started".into())
}

pub fn send(child: &Child, signal: Signal) -> Outcome {
    Ok(kill(Pid::from_raw(child.id() as i32), signal)?)
}

pub fn report_of(child: &mut Child) -> Result<RunReport, Box<dyn std::error::Error>> {
    let mut text = String::new();
    child.stdout.take().ok_or("no stdout")?.read_to_string(&mut text)?;
    child.wait()?;
    Ok(serde_json::from_str(&text)?)
}
