//! The contact task with its real nodes: what becomes of them, of the bag, and of shared memory.

mod common;

use backdrive_launch::{Cause, RunHome, RunReport};
use common::{Outcome, processes_of, report_of, runs_in, send, shm_of, supervisor, until, wait_for_start};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::path::{Path, PathBuf};
use std::process::Child;

const GRAPH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/contact.toml");

struct Bench {
    temp: tempfile::TempDir,
    home: PathBuf,
    bag: PathBuf,
}

impl Bench {
    fn new() -> std::io::Result<Bench> {
        let temp = tempfile::tempdir()?;
        Ok(Bench { home: temp.path().join("runs"), bag: temp.path().join("run.mcap"), temp })
    }

    fn start(&self, graph: &str, seconds: f64, clock: &str) -> std::io::Result<Child> {
        // The words are split at spaces, of which a temporary directory has none.
        let words = format!("{graph} {} {seconds} {clock}", self.bag.display());
        supervisor(Path::new("graph"), &format!("{} {words}", self.home.display()))
    }

    /// The graph with its slave started again when it dies.
    fn with_restart(&self) -> Result<String, Box<dyn std::error::Error>> {
        let plant = concat!(env!("CARGO_MANIFEST_DIR"), "/../plant");
        let text =
            std::fs::read_to_string(GRAPH)?.replace("../plant", plant).replace("kind = \"slave\"", "kind = \"slave\"\nrestart = true");
        let path = self.temp.path().join("restart.toml");
        std::fs::write(&path, text)?;
        Ok(path.display().to_string())
    }

    fn kill(&self, node: &str) -> Outcome {
        for pid in processes_of(&self.home) {
            let arguments = std::fs::read(format!("/proc/{pid}/cmdline"))?;
            if String::from_utf8_lossy(&arguments).contains(&format!("--name\0{node}\0")) {
                kill(Pid::from_raw(pid), Signal::SIGKILL)?;
                return Ok(());
            }
        }
        Err(format!("{node} is not there").into())
    }

    /// Nothing but the bag is left.
    fn is_clean(&self, report: &RunReport) {
        assert_eq!(runs_in(&self.home), [""; 0]);
        assert_eq!(processes_of(&self.home), [0; 0]);
        assert_eq!(shm_of(std::slice::from_ref(&report.id)), [""; 0]);
    }
}

/// Reads on what it writes, so that it never waits.
fn watch(child: &mut Child) -> Outcome {
    let mut errors = wait_for_start(child)?;
    std::thread::spawn(move || std::io::copy(&mut errors, &mut std::io::stderr()));
    Ok(())
}

#[test]
fn a_run_in_lockstep_is_whole() -> Outcome {
    let bench = Bench::new()?;
    let mut child = bench.start(GRAPH, 1.0, "lockstep")?;
    let report = report_of(&mut child)?;
    assert_eq!(report.cause, Cause::Completed);
    assert!(report.orderly());
    assert_eq!((report.steps, report.lost, report.unrecorded), (5000, 0, Some(0)));
    assert!(report.recorded.is_some_and(|(messages, bytes)| messages > 5000 && bytes > 0));
    assert!(bench.bag.exists());
    bench.is_clean(&report);
    Ok(())
}

#[test]
fn in_real_time_a_killed_slave_comes_back_and_the_bag_is_finished() -> Outcome {
    let bench = Bench::new()?;
    let mut child = bench.start(&bench.with_restart()?, 4.0, "realtime")?;
    watch(&mut child)?;
    bench.kill("slave")?;
    let report = report_of(&mut child)?;
    assert_eq!(report.deaths.len(), 1);
    assert!(report.deaths[0].recovered);
    assert_eq!(report.deaths[0].signal, Some(9));
    assert_eq!(report.steps, 20_000);
    assert!(bench.bag.exists());
    bench.is_clean(&report);
    Ok(())
}

#[test]
fn in_lockstep_any_killed_node_stops_the_run() -> Outcome {
    for node in ["operator", "canceller", "recorder"] {
        let bench = Bench::new()?;
        let mut child = bench.start(GRAPH, 3600.0, "lockstep")?;
        watch(&mut child)?;
        bench.kill(node)?;
        let report = report_of(&mut child)?;
        assert!(matches!(&report.cause, Cause::NodeDied { node: dead, .. } if dead == node), "{:?}", report.cause);
        assert_eq!(report.killed, [""; 0]);
        assert_eq!(report.deaths.len(), 1, "{:?}", report.deaths);
        bench.is_clean(&report);
    }
    Ok(())
}

#[test]
fn an_interrupt_finishes_the_bag() -> Outcome {
    let bench = Bench::new()?;
    let mut child = bench.start(GRAPH, 3600.0, "realtime")?;
    watch(&mut child)?;
    send(&child, Signal::SIGINT)?;
    let report = report_of(&mut child)?;
    assert_eq!(report.cause, Cause::Stopped { by: "SIGINT".to_string() });
    assert!(report.nodes.iter().all(|n| n.end == "done"), "{:?}", report.nodes);
    bench.is_clean(&report);
    Ok(())
}

#[test]
fn nothing_outlives_a_killed_supervisor() -> Outcome {
    let bench = Bench::new()?;
    let mut child = bench.start(GRAPH, 3600.0, "lockstep")?;
    watch(&mut child)?;
    let ids = runs_in(&bench.home);
    child.kill()?;
    child.wait()?;
    until("its processes have ended", || processes_of(&bench.home).is_empty())?;
    // The last of them has removed it all.
    assert_eq!(shm_of(&ids), [""; 0]);
    assert_eq!(runs_in(&bench.home), [""; 0]);
    assert_eq!(RunHome::at(&bench.home).clean().removed.len(), 0);
    Ok(())
}
