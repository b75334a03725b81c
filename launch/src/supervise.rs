//! Starting and ending a run.

use crate::error::LaunchError;
use crate::place::Place;
use crate::plan::Plan;
use crate::report::RunReport;
use crate::rundir::RunHome;
use crate::screen::{Display, Screen};
use crate::signals::Signals;
use crate::watch::Supervisor;
use backdrive_nodes::graph::Graph;
use std::time::Duration;
use tokio::sync::mpsc;

/// How a run is supervised.
#[derive(Debug)]
pub struct SuperviseOptions {
    /// Program and first arguments of a node process; `node --run ROOT --name NAME` is added. Empty: this program.
    pub node_command: Vec<String>,
    /// Where run directories are.
    pub home: RunHome,
    /// How long nodes may take to find each other. Default 15 s.
    pub ready_timeout: Duration,
    /// How long a node may take to end at each step of asking it: `Stop`, SIGTERM, SIGKILL. Default 3 s.
    pub grace: Duration,
    /// The same for the recorder, counted from its last progress: it finishes its file. Default 20 s.
    pub recorder_grace: Duration,
    /// What the death of a node means for the others.
    pub on_death: OnDeath,
    /// How often a node with `restart = true` is started again in one run. Default 5.
    pub max_restarts: u32,
    /// What is shown.
    pub display: Display,
    /// Time between two lines where there is no live line. Default 5 s.
    pub status_every: Duration,
    /// Longest time to spend on what dead runs have left, before the start. Default 1 s.
    pub sweep_limit: Duration,
    /// What may be asked of the run while it lasts.
    pub commands: Option<mpsc::Receiver<Command>>,
}

impl Default for SuperviseOptions {
    fn default() -> SuperviseOptions {
        SuperviseOptions {
            node_command: Vec::new(),
            home: RunHome::system(),
            ready_timeout: Duration::from_secs(15),
            grace: Duration::from_secs(3),
            recorder_grace: Duration::from_secs(20),
            on_death: OnDeath::Auto,
            max_restarts: 5,
            display: Display::Auto,
            status_every: Duration::from_secs(5),
            sweep_limit: Duration::from_secs(1),
            commands: None,
        }
    }
}

/// What it means for the others when a node dies and is not started again. In lockstep the run always
/// stops: without the samples of the dead node no other can step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OnDeath {
    /// In real time the others go on: the master's force decays, the slave holds, and the hand is not
    /// left with a device that has ended under it. But a run whose recorder dies stops: what is not
    /// recorded is lost for good.
    #[default]
    Auto,
    /// The run stops.
    Stop,
    /// In real time the others go on, even without a recorder.
    Continue,
}

/// What may be asked of a run while it lasts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Change the gains. Asked before the start, it takes effect at the start; a node with gains that is
    /// started again is told the last ones.
    Gains {
        /// Position scale.
        mu: f64,
        /// Force scale.
        lambda: f64,
        /// Ramp, s, not negative.
        ramp_s: f64,
    },
    /// End in order, as with Ctrl-C.
    Stop,
}

/// Runs a graph to its end: see [`supervise_plan`].
///
/// # Errors
/// The run cannot start. What goes wrong after the start is in the report.
pub async fn supervise(graph: &Graph, place: &Place, options: SuperviseOptions) -> Result<RunReport, LaunchError> {
    supervise_plan(Plan::of(graph, place), options).await
}

/// [`supervise`] for a caller without an asynchronous runtime.
///
/// # Errors
/// The run cannot start. What goes wrong after the start is in the report.
pub fn run(graph: &Graph, place: &Place, options: SuperviseOptions) -> Result<RunReport, LaunchError> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|e| LaunchError::Runtime { what: "processes", reason: e.to_string() })?;
    runtime.block_on(supervise(graph, place, options))
}

/// Runs a graph to its end: makes the run directory, starts a process per node, waits until they have
/// found each other, starts the clock, watches, and ends them. When it returns, every process of the run
/// is reaped and its directory and shared memory are removed, whatever happened.
///
/// SIGINT, SIGTERM and SIGHUP stop the run in order, the recorder last; another SIGINT kills it. While
/// it runs, SIGTSTP is refused.
///
/// The processes die with the thread that runs this, so it must be one that lasts: a current-thread
/// runtime, or `block_on` of the main thread.
///
/// # Errors
/// The run cannot start. What goes wrong after the start is in the report.
pub async fn supervise_plan(mut plan: Plan, mut options: SuperviseOptions) -> Result<RunReport, LaunchError> {
    if plan.nodes.is_empty() {
        return Err(LaunchError::NoNodes);
    }
    // A recorder ends when the others have; alone it is a node like any other.
    if plan.nodes.iter().all(|n| n.records) {
        plan.nodes.iter_mut().for_each(|n| n.records = false);
    }
    if options.node_command.is_empty() {
        let this = std::env::current_exe().map_err(|e| LaunchError::Runtime { what: "this program", reason: e.to_string() })?;
        options.node_command = vec![this.to_string_lossy().into_owned()];
    }
    // Before anything is made, so that a signal never leaves something behind.
    let signals = Signals::watch()?;
    let screen = Screen::new(options.display, options.status_every);
    let swept = options.home.sweep(options.sweep_limit);
    if options.display != Display::Quiet {
        for run in &swept.removed {
            screen.line(format!("removed what the dead run {} had left", run.id));
        }
    }
    for failure in &swept.failed {
        screen.line(format!("warning: left by a dead run: {failure}"));
    }
    let directory = options.home.create(&plan.text, plan.nodes.len())?;
    if plan.place != Place::default() {
        directory.tell_place(&plan.place)?;
    }
    let commands = options.commands.take();
    Supervisor::new(plan, options, directory, screen).run(signals, commands).await
}
