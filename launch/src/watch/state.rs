//! A run that is watched: its nodes, when it began, and what has happened.

use crate::child::Notice;
use crate::error::LaunchError;
use crate::hosts::Hosts;
use crate::options::SuperviseOptions;
use crate::plan::Plan;
use crate::report::{Cause, Death, RunEvent};
use crate::rundir::RunDir;
use crate::screen::Screen;
use crate::session::Session;
use crate::slot::Slot;
use backdrive_nodes::protocol::ToNode;
use std::collections::VecDeque;
use std::time::Instant;
use tokio::sync::mpsc;

/// Step 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Start {
    pub at: Instant,
    pub(crate) t0_ns: i64,
    pub(crate) unix_ns: i64,
}

pub(crate) struct Supervisor {
    pub plan: Plan,
    pub options: SuperviseOptions,
    pub directory: RunDir,
    pub screen: Screen,
    pub slots: Vec<Slot>,
    pub begun: Instant,
    pub connected: Option<Instant>,
    pub start: Option<Start>,
    /// When the last node but the recorder had ended.
    pub finished: Option<Instant>,
    /// Since when the first node is done.
    pub(crate) finishing: Option<Instant>,
    pub stopping: bool,
    pub(crate) killing: bool,
    /// Why it was stopped.
    pub cause: Option<Cause>,
    /// The first node that is lost for good.
    pub loss: Option<Cause>,
    pub(crate) error: Option<LaunchError>,
    pub(crate) gains: Option<ToNode>,
    /// When a run whose force has been removed ends, and who asked for that.
    pub(crate) release: Option<(Instant, String)>,
    pub events: Vec<RunEvent>,
    pub events_left_out: u64,
    pub deaths: Vec<Death>,
    pub killed: Vec<String>,
    pub(crate) unkillable: bool,
    /// (when, steps) of the last seconds.
    pub pace: VecDeque<(Instant, u64)>,
    /// Who the run is on the network.
    pub(crate) session: Session,
    /// The other hosts of the run, if it has some, and who of them is missing.
    pub(crate) hosts: Option<Hosts>,
    pub(crate) absent: Vec<String>,
    pub(crate) notices: mpsc::Sender<Notice>,
    pub(crate) heard: Option<mpsc::Receiver<Notice>>,
}

/// Events that are kept.
pub(crate) const MOST_EVENTS: usize = 10_000;

impl Supervisor {
    pub fn new(plan: Plan, options: SuperviseOptions, directory: RunDir, screen: Screen, session: Session) -> Supervisor {
        let now = Instant::now();
        let slots = plan.nodes.iter().map(|n| Slot::new(n.clone(), now)).collect();
        let (notices, heard) = mpsc::channel(1024);
        Supervisor {
            plan,
            options,
            directory,
            screen,
            slots,
            begun: now,
            connected: None,
            start: None,
            finished: None,
            finishing: None,
            stopping: false,
            killing: false,
            cause: None,
            loss: None,
            error: None,
            gains: None,
            release: None,
            events: Vec::new(),
            events_left_out: 0,
            deaths: Vec::new(),
            killed: Vec::new(),
            unkillable: false,
            pace: VecDeque::new(),
            session,
            hosts: None,
            absent: Vec::new(),
            notices,
            heard: Some(heard),
        }
    }
}
