//! Processes of our nodes, and the recorder, started and waited for as a supervisor does it.

use super::Result;
use super::children::Process;
use backdrive_bags::Completeness;
use backdrive_msgs::Message;
use backdrive_nodes::clock::{Start, now_ns};
use backdrive_nodes::protocol::{FromNode, NodeStatus, ToNode};
use backdrive_nodes::recorder::Sink;
use backdrive_nodes::runner::RunError;
use backdrive_nodes::transport::Location;
use std::process::Stdio;

/// A recorder's sink: checks sequence numbers and throws away.
#[derive(Default)]
pub struct Counting {
    next: Vec<u64>,
    lost: u64,
    written: u64,
}

impl Sink for Counting {
    fn push(&mut self, topic: usize, message: Message, _: i64) -> std::result::Result<(), RunError> {
        if self.next.len() <= topic {
            self.next.resize(topic + 1, 0);
        }
        self.lost += message.sequence().saturating_sub(self.next[topic]);
        self.next[topic] = message.sequence() + 1;
        self.written += 1;
        Ok(())
    }

    fn health(&self) -> (u64, u64, u64) {
        (self.written, 0, self.lost)
    }

    fn finish(self: Box<Self>) -> std::result::Result<Completeness, RunError> {
        match self.lost {
            0 => Ok(Completeness::default()),
            lost => Err(RunError::Incomplete { lost }),
        }
    }
}

fn next(process: &mut Process) -> Result<FromNode> {
    Ok(serde_json::from_str(&process.line()?)?)
}

fn until_ready(process: &mut Process) -> Result<()> {
    loop {
        match next(process)? {
            FromNode::Ready => return Ok(()),
            FromNode::Failed { error, .. } => return Err(error.into()),
            _ => {}
        }
    }
}

/// The figures of its master, or of its first node.
fn until_done(process: &mut Process) -> Result<NodeStatus> {
    let mut master = None;
    loop {
        match next(process)? {
            FromNode::Of { node, said } if node == "master" => {
                if let FromNode::Status(status) = *said {
                    master = Some(status);
                }
            }
            FromNode::Done(status) => return Ok(master.unwrap_or(status)),
            FromNode::Failed { error, .. } => return Err(error.into()),
            _ => {}
        }
    }
}

/// How a run of processes went.
pub struct Ended {
    /// From the start to the end of the one that was timed, s.
    pub seconds: f64,
    /// The report of the timed one when it was done.
    pub status: NodeStatus,
    /// The line that the timed one wrote after that; empty if none.
    pub last: String,
}

/// The processes of a run, and where they meet, which is removed after their end.
struct Run {
    processes: Vec<Process>,
    location: Location,
    /// Holds the location's files.
    _root: tempfile::TempDir,
}

impl Drop for Run {
    fn drop(&mut self) {
        self.processes.clear();
        if let Err(error) = self.location.remove() {
            eprintln!("{error}");
        }
    }
}

/// Runs processes of this program, which get `WHAT NAME LOCATION STEPS HOW` as arguments; `processes` are names and hows. Those of the
/// one at `timed` are the figures.
pub fn run(steps: u64, what: &str, processes: &[(String, String)], timed: usize) -> Result<Ended> {
    let root = tempfile::tempdir()?;
    let location = Location { prefix: format!("ring{}_", std::process::id()), root: root.path().join("run") };
    let (place, steps) = (serde_json::to_string(&location)?, steps.to_string());
    let mut run = Run { processes: Vec::new(), location, _root: root };
    for (name, how) in processes {
        run.processes.push(Process::start(&[what, name, &place, &steps, how], Stdio::piped())?);
    }
    run.processes.iter_mut().try_for_each(until_ready)?;
    let Start { t0_ns, unix_ns } = Start::after(0);
    let start = serde_json::to_string(&ToNode::Start { t0_ns, unix_ns })?;
    let begun = now_ns();
    // The source last: the others are then all waiting when it begins.
    for process in run.processes.iter_mut().rev() {
        process.say(&start)?;
    }
    let status = until_done(&mut run.processes[timed])?;
    let seconds = (now_ns() - begun) as f64 * 1e-9;
    let last = run.processes[timed].line()?;
    for (i, process) in run.processes.iter_mut().enumerate() {
        if i != timed {
            until_done(process)?;
        }
        process.wait()?;
    }
    Ok(Ended { seconds, status, last })
}
