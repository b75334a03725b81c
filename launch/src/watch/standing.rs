//! Processes that stand still although the run is to end.

use super::state::Supervisor;
use crate::proc_stat::ProcStat;
use crate::slot::Asked;
use nix::sys::signal::Signal;
use std::time::{Duration, Instant};

/// How long a process may stay stopped after it was continued.
const STAYS_STOPPED: Duration = Duration::from_millis(500);

/// How long after the planned end it is waited in vain for the first node that is done.
const OVERDUE: Duration = Duration::from_secs(1);

impl Supervisor {
    /// In real time the planned end is a time of day. Where every node stands still, none reports that it has come.
    pub(crate) fn see_planned_end(&mut self, now: Instant) {
        if self.plan.realtime() && self.planned_end().is_some_and(|end| now.saturating_duration_since(end) > OVERDUE) {
            self.finishing.get_or_insert(now);
        }
    }

    /// When the last of the planned steps is due, in real time.
    pub(crate) fn planned_end(&self) -> Option<Instant> {
        let lasts = Duration::try_from_secs_f64(self.plan.timing.steps? as f64 / self.plan.timing.rate_hz).ok()?;
        self.start?.at.checked_add(lasts)
    }

    /// Continues what somebody has stopped, so that it can end in order and a recorder closes its bag. What is stopped again is killed.
    pub(crate) fn continue_stopped(&mut self, now: Instant) {
        if !self.stopping && self.finishing.is_none() && self.finished.is_none() {
            return;
        }
        for index in 0..self.slots.len() {
            let slot = &mut self.slots[index];
            let Some(child) = &slot.child else { continue };
            let Some(stat) = ProcStat::of(child.pid()) else { continue };
            if slot.stat.is_none_or(|before| stat.has_worked_since(&before)) {
                slot.worked = now;
            }
            slot.stat = Some(stat);
            if !stat.is_stopped() {
                continue;
            }
            match slot.continued {
                None => {
                    slot.continued = Some(now);
                    child.signal(Signal::SIGCONT);
                    let text = format!("`{}` had been stopped (SIGSTOP); it is continued, so that it can end", slot.plan.label());
                    self.tell(1, "node_continued", text);
                }
                Some(at) if now.saturating_duration_since(at) > STAYS_STOPPED => slot.ask(Asked::Kill, now),
                Some(_) => child.signal(Signal::SIGCONT),
            }
        }
    }
}
