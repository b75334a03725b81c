//! How a run is supervised, and what may be asked of it.

use crate::paths::RunPaths;
use crate::rundir::RunHome;
use crate::screen::Display;
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
    /// How long a node may take to end after `Stop`, before SIGTERM; SIGKILL follows 1 s later. Default 3 s. One that was stopped by a signal
    /// is continued first, and killed if it is stopped again.
    pub grace: Duration,
    /// The same for a recorder that works, counted from its last progress: it finishes its file. Default 20 s. One that does nothing for
    /// 3 s has no more time than a node.
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
    /// Who wants to know where the run is, as soon as it has a place and before its nodes meet.
    pub created: Option<std::sync::mpsc::Sender<RunPaths>>,
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
            created: None,
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
    /// Change the gains. Asked before the start, it takes effect at the start; a node with gains that is restarted gets the last ones.
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
