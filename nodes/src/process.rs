//! A node as a process of its own, in conversation with the supervisor (see [`crate::protocol`]).
//!
//! Two threads beside the loop do the talking, so that a full pipe or a slow reader never stalls it:
//! one reads standard input, one writes standard output.

use crate::clock::Start;
use crate::protocol::{FromNode, NodeStatus, ToNode};
use crate::realtime;
use crate::runner::{Control, Options, RunError, Runner, Told};
use crate::stage::{Clock, NodePlan, Timing};
use crate::transport::Transport;
use backdrive_msgs::{measured, source_id};
use nix::sys::signal::{SigHandler, Signal, signal};
use std::io::{BufRead, Write};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How a process runs, beyond the settings of the graph.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProcessOptions {
    /// Of the loop.
    pub run: Options,
    /// Of the operating system; used in real time only.
    pub realtime: realtime::Options,
}

/// Time from a stop to the end of a process whose loop does not end by itself; for a recorder, which has a file to close, from the supervisor's
/// death too.
pub(crate) const GRACE: Duration = Duration::from_secs(3);

/// Time from the supervisor's death to the end of a node whose loop does not end by itself.
const ORPHANED: Duration = Duration::from_millis(700);

/// Runs a node as this process until its steps are done, the supervisor stops it or is gone, or it fails. Its last line of output is `done` or
/// `failed`; the exit code is 0 or that of the failure.
///
/// `listeners` names how many listeners each topic has in the graph: the node is ready when they are all there.
pub fn run_process(plan: NodePlan, timing: &Timing, transport: Box<dyn Transport>, options: ProcessOptions) -> ExitCode {
    run_processes(vec![plan], timing, transport, options)
}

/// The same for nodes that share this process and its thread. Lines about the first have the form of a process of its own, and those about the others
/// carry their names ([`FromNode::Of`]).
pub fn run_processes(plans: Vec<NodePlan>, timing: &Timing, transport: Box<dyn Transport>, options: ProcessOptions) -> ExitCode {
    let others: Vec<String> = plans.iter().skip(1).map(|p| p.name.clone()).collect();
    let line = Line::open(ORPHANED, others.clone());
    let timing = timing.clone();
    line.supervised(|line| {
        let mut runner = Runner::together(plans, &timing, transport, options.run)?;
        runner.begin(&mut |told| line.tell(told))?;
        let Some(start) = line.meet(|| runner.check_alone().map(|()| runner.missing()))? else {
            return Ok(NodeStatus::default());
        };
        let mut tell = |told| line.tell(told);
        if timing.clock == Clock::Realtime {
            let refused = realtime::enter(&options.realtime);
            if !refused.is_empty() {
                runner.note("realtime_refused", 1, &refused.join("; "), &mut tell);
            }
        }
        let mut reports = runner.run(start, &line.control, &mut tell)?.into_iter();
        let first = reports.next().unwrap_or_default();
        for (node, status) in others.iter().zip(reports) {
            line.say(FromNode::Of { node: node.clone(), said: Box::new(FromNode::Status(status)) });
        }
        Ok(first)
    })
}

/// The line to the supervisor.
pub(crate) struct Line {
    pub control: Arc<Control>,
    start: Receiver<Start>,
    out: SyncSender<Out>,
    writer: Mutex<Option<JoinHandle<()>>>,
}

/// Reported often, printed rarely.
#[allow(clippy::large_enum_variant)]
enum Out {
    Told(Told),
    Said(Box<FromNode>),
}

/// Set by SIGTERM.
static TERMINATED: AtomicBool = AtomicBool::new(false);

extern "C" fn on_terminate(_: i32) {
    TERMINATED.store(true, Ordering::SeqCst);
}

impl Line {
    /// Starts to listen and to talk; a process whose loop does not end by itself ends `orphaned` after the supervisor.
    /// `others` names the nodes of the process beside the first.
    pub fn open(orphaned: Duration, others: Vec<String>) -> Line {
        // An interrupt from the keyboard goes to the whole group; the supervisor stops us in order.
        // SAFETY: the handlers do nothing but store to an atomic.
        unsafe {
            let _ = signal(Signal::SIGINT, SigHandler::SigIgn);
            let _ = signal(Signal::SIGTERM, SigHandler::Handler(on_terminate));
        }
        // The end of standard input shows that the supervisor is gone, but not to a process that is stopped: its death wakes it up. (The kernel sends
        // this when the starting *thread* ends, so nothing that ends the process may be used here.)
        let _ = nix::sys::prctl::set_pdeathsig(Signal::SIGCONT);
        let control = Arc::new(Control::default());
        let (to_start, start) = sync_channel(1);
        let (out, said) = sync_channel(256);
        let writer = std::thread::spawn(move || write_lines(&said, &others));
        let reader = Arc::clone(&control);
        std::thread::spawn(move || {
            read_lines(&reader, &to_start);
            drop(to_start);
            reader.stop();
            std::thread::sleep(orphaned);
            // The loop is stuck in a step: better gone than an orphan.
            std::process::exit(5);
        });
        let watched = Arc::clone(&control);
        std::thread::spawn(move || watch(&watched, orphaned));
        Line { control, start, out, writer: Mutex::new(Some(writer)) }
    }

    /// Passes on what a loop reports; never blocks. What does not fit is dropped: it has been published as well.
    pub fn tell(&self, told: Told) {
        let _ = self.out.try_send(Out::Told(told));
    }

    fn say(&self, message: FromNode) {
        // An error means that the writer is gone, and with it the one who would hear of it.
        let _ = self.out.send(Out::Said(Box::new(message)));
    }

    /// Prints `created`, then `ready` once nothing is missing, and waits for the start. `None` when stopped before.
    ///
    /// # Errors
    /// Those of `missing`, which is asked until the start.
    pub fn meet(&self, mut missing: impl FnMut() -> Result<Vec<String>, RunError>) -> Result<Option<Start>, RunError> {
        self.say(FromNode::Created);
        let (mut complained, mut ready) = (Instant::now(), false);
        loop {
            let lacks = missing()?;
            if !ready {
                ready = lacks.is_empty();
                if ready {
                    self.say(FromNode::Ready);
                } else if complained.elapsed() >= Duration::from_secs(2) {
                    complained = Instant::now();
                    self.say(FromNode::Waiting { missing: lacks });
                }
            }
            if self.control.is_stopped() {
                return Ok(None);
            }
            match self.start.recv_timeout(Duration::from_millis(if ready { 20 } else { 2 })) {
                Ok(start) => return Ok(Some(start)),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
            }
        }
    }

    /// Does the work and reports how it ended, last of all; the work's ports are gone by then.
    pub fn supervised(&self, work: impl FnOnce(&Line) -> Result<NodeStatus, RunError>) -> ExitCode {
        let result = work(self);
        let (last, code) = match result {
            Ok(status) => (FromNode::Done(status), ExitCode::SUCCESS),
            Err(e) => (FromNode::Failed { error: e.to_string(), code: e.code() }, ExitCode::from(e.code())),
        };
        self.say(last);
        if let Some(writer) = self.writer.lock().unwrap_or_else(PoisonError::into_inner).take() {
            let _ = writer.join();
        }
        code
    }
}

/// Writes one line per message; ends after the last one, or when the reader is gone.
fn write_lines(said: &Receiver<Out>, others: &[String]) {
    let others: Vec<(u32, &String)> = others.iter().map(|name| (source_id(name), name)).collect();
    let mut stdout = std::io::stdout().lock();
    for out in said.iter() {
        let message = match out {
            Out::Said(message) => *message,
            Out::Told(told) => spell(told, &others),
        };
        let is_last = matches!(message, FromNode::Done(_) | FromNode::Failed { .. });
        let Ok(mut line) = serde_json::to_vec(&message) else { continue };
        line.push(b'\n');
        if stdout.write_all(&line).and_then(|()| stdout.flush()).is_err() || is_last {
            return;
        }
    }
}

fn spell(told: Told, others: &[(u32, &String)]) -> FromNode {
    let (source, said) = match told {
        Told::Status { source, status } => (source, FromNode::Status(status)),
        Told::Event(event) => (
            event.source,
            FromNode::Event {
                step: event.step,
                severity: event.severity,
                kind: event.kind.as_str().to_string(),
                text: event.text.as_str().to_string(),
                value: measured(event.value),
            },
        ),
    };
    match others.iter().find(|(other, _)| *other == source) {
        Some((_, name)) => FromNode::Of { node: (*name).clone(), said: Box::new(said) },
        None => said,
    }
}

/// Follows the supervisor's commands until their end.
fn read_lines(control: &Control, start: &SyncSender<Start>) {
    for line in std::io::stdin().lock().lines() {
        let Ok(line) = line else { return };
        match serde_json::from_str(&line) {
            Ok(ToNode::Start { t0_ns, unix_ns }) => {
                let _ = start.try_send(Start { t0_ns, unix_ns });
            }
            Ok(ToNode::Stop) => control.stop(),
            Ok(ToNode::Gains { mu, lambda, ramp_s }) => control.set_gains(mu, lambda, ramp_s),
            Ok(ToNode::Canceller { on, ramp_s }) => control.switch_canceller(on, ramp_s),
            Ok(ToNode::Note(note)) => control.note(note),
            Err(e) => {
                let _ = writeln!(std::io::stderr(), "not understood from the supervisor: {e}: {line}");
            }
        }
    }
}

/// Stops the loop on SIGTERM, or when the parent has died while something else still holds our standard input open.
fn watch(control: &Control, orphaned: Duration) {
    let parent = nix::unistd::getppid();
    while !control.is_stopped() {
        std::thread::sleep(Duration::from_millis(100));
        let alone = nix::unistd::getppid() != parent;
        if TERMINATED.load(Ordering::SeqCst) || alone {
            control.stop();
            std::thread::sleep(if alone { orphaned } else { GRACE });
            std::process::exit(5);
        }
    }
}
