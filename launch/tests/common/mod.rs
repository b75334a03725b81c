//! Graphs of toy nodes.
#![allow(dead_code)] // each test file uses its part

use backdrive_launch::{Display, NodePlan, Plan, RunHome, SuperviseOptions};
use backdrive_nodes::stage::{Clock, Timing};
use std::path::Path;
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
        title: "toys".to_string(),
        text: "title = \"toys\"\n".to_string(),
        timing: Timing { rate_hz: 1000.0, clock, steps, peer_timeout_s: 1.0 },
        bag: None,
        nodes,
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
