//! Asking the nodes to end, and killing those that do not.

use super::state::Supervisor;
use crate::error::LaunchError;
use crate::report::Cause;
use crate::screen::Display;
use crate::slot::{Asked, Phase};
use nix::sys::signal::Signal;
use std::time::Instant;

impl Supervisor {
    pub(crate) fn signalled(&mut self, signal: Signal) {
        match signal {
            Signal::SIGTSTP => {
                self.screen.line("a run cannot be suspended, because its loop would continue unsupervised; Ctrl-C stops it".to_string())
            }
            Signal::SIGINT if self.stopping => {
                self.screen.line("killing the remaining processes".to_string());
                self.kill();
            }
            _ => {
                if self.options.display != Display::Quiet {
                    self.screen.line("stopping in order; another Ctrl-C kills".to_string());
                }
                let by = signal.as_str().to_string();
                if self.start.is_none() && self.error.is_none() {
                    self.error = Some(LaunchError::Stopped { by: by.clone() });
                }
                self.stop(Cause::Stopped { by });
            }
        }
    }

    /// Ends the run in order: the recorder goes last, so that it hears the others to the end.
    pub(crate) fn stop(&mut self, cause: Cause) {
        if self.stopping {
            return;
        }
        let now = Instant::now();
        self.stopping = true;
        self.cause.get_or_insert(cause);
        for slot in &mut self.slots {
            if matches!(slot.phase, Phase::Backoff { .. }) {
                slot.enter(Phase::Ended, now);
            } else if !slot.plan.records || self.start.is_none() {
                slot.ask(Asked::Stop, now);
            }
        }
    }

    /// Ends a run that cannot start.
    pub(crate) fn give_up(&mut self, error: LaunchError) {
        self.error.get_or_insert(error);
        self.stop(Cause::Completed);
    }

    pub(crate) fn kill(&mut self) {
        self.killing = true;
        let now = Instant::now();
        for slot in &mut self.slots {
            match slot.child {
                Some(_) => slot.ask(Asked::Kill, now),
                None => slot.enter(Phase::Ended, now),
            }
        }
    }
}
