//! Starting and ending a run.

use crate::domain_claim::DomainClaim;
use crate::error::LaunchError;
use crate::options::SuperviseOptions;
use crate::place::Place;
use crate::plan::Plan;
use crate::report::RunReport;
use crate::screen::{Display, Screen};
use crate::session::Session;
use crate::signals::Signals;
use crate::watch::Supervisor;
use backdrive_nodes::graph::Graph;

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
    // Before anything is made, and held until the run has ended.
    let _claim = DomainClaim::take(&plan)?;
    let swept = options.home.sweep(options.sweep_limit);
    if options.display != Display::Quiet {
        for run in &swept.removed {
            screen.line(format!("removed what the dead run {} had left", run.id));
        }
    }
    for failure in &swept.failed {
        screen.line(format!("warning: left by a dead run: {failure}"));
    }
    let directory = options.home.create_with(&plan.text, &plan.held, plan.nodes.len())?;
    if plan.place != Place::default() {
        directory.tell_place(&plan.place)?;
    }
    let session = Session::begin(&plan, directory.paths())?;
    directory.tell_identity(&session.known)?;
    let commands = options.commands.take();
    let asks =
        crate::asks::listen(directory.paths()).map_err(|e| screen.line(format!("warning: nothing can be asked of this run: {e}"))).ok();
    if let Some(created) = options.created.take() {
        // Who wanted to know may be gone.
        let _ = created.send(directory.paths().clone());
    }
    Supervisor::new(plan, options, directory, screen, session).run(signals, commands, asks).await
}
