//! What is due at a time: restarts, silence, the next step of ending.

use super::state::Supervisor;
use crate::child::{Child, End};
use crate::error::LaunchError;
use crate::proc_stat::ProcStat;
use crate::slot::{Asked, Phase, Slot};
use std::time::{Duration, Instant};

/// In real time a node that is not heard for this long is reported.
const SILENCE: Duration = Duration::from_secs(3);

/// How long a recorder that was asked to end may neither make progress nor use its processor.
const STANDS_STILL: Duration = Duration::from_secs(3);

/// Time from SIGTERM to SIGKILL, for one that does nothing; it has been asked before.
const TERM_GRACE: Duration = Duration::from_secs(1);

/// How long a recorder may take to see by itself that the planned steps are over.
const RECORDER_LEAD: Duration = Duration::from_secs(1);

/// How long a killed process may take to be gone before it is given up.
const UNKILLABLE: Duration = Duration::from_secs(10);

impl Supervisor {
    /// Whatever is due.
    pub(crate) fn act(&mut self, now: Instant) {
        self.meet();
        self.released(now);
        self.see_planned_end(now);
        self.continue_stopped(now);
        if self.start.is_none() && !self.stopping && now.saturating_duration_since(self.begun) > self.options.ready_timeout {
            let mut missing: Vec<String> = self.slots.iter().filter(|s| s.phase == Phase::Joining).map(Slot::lack).collect();
            missing.append(&mut self.absent);
            self.give_up(LaunchError::NotReady { after_s: self.options.ready_timeout.as_secs_f64(), missing });
        }
        for index in 0..self.slots.len() {
            self.act_on(index, now);
        }
        if self.start.is_some() && self.slots.iter().all(|s| s.plan.records || s.ended()) {
            let finished = *self.finished.get_or_insert(now);
            let by_itself = self.finishing.is_some() && !self.stopping && now.saturating_duration_since(finished) < RECORDER_LEAD;
            if !by_itself {
                for slot in self.slots.iter_mut().filter(|s| s.asked == Asked::No) {
                    slot.ask(Asked::Stop, now);
                }
            }
        }
    }

    fn act_on(&mut self, index: usize, now: Instant) {
        let started = self.start.is_some();
        let slot = &mut self.slots[index];
        let grace = self.options.grace;
        let since = |from: Instant| now.saturating_duration_since(from);
        // A recorder has a file to end, on a disk that may be slow: while it works it has time.
        let (idle_since, over) = match slot.plan.records {
            true => {
                let (progress, idle_since) = (slot.asked_at.max(slot.progress), slot.asked_at.max(slot.progress).max(slot.worked));
                (idle_since, since(idle_since) > grace.max(STANDS_STILL) || since(progress) > self.options.recorder_grace)
            }
            false => (slot.asked_at, since(slot.asked_at) > grace),
        };
        match (slot.phase, slot.asked) {
            (Phase::Ended, _) => {}
            (Phase::Backoff { until }, _) if now >= until => {
                if let Err(e) = self.spawn(index) {
                    let slot = &mut self.slots[index];
                    slot.failed = Some((e.to_string(), 1));
                    slot.restarts = self.options.max_restarts;
                    self.died(index, End { code: None, signal: None }, now);
                }
            }
            (Phase::Backoff { .. }, _) => {}
            (_, Asked::Stop) if over => slot.ask(Asked::Term, now),
            (_, Asked::Term) if over || since(idle_since) > TERM_GRACE => slot.ask(Asked::Kill, now),
            (_, Asked::Kill) if now.saturating_duration_since(slot.asked_at) > UNKILLABLE => {
                slot.end = "does not die".to_string();
                slot.enter(Phase::Ended, now);
                self.unkillable = true;
                self.killed.push(slot.plan.label());
                let text = format!("`{}` does not die; what the run leaves is removed at the next start", slot.plan.label());
                self.tell(2, "node_unkillable", text);
            }
            (Phase::Joining, Asked::No) if started && now.saturating_duration_since(slot.since) > self.options.ready_timeout => {
                slot.failed = Some((format!("was not ready in time after it was started again: {}", slot.lack()), 1));
                slot.ask(Asked::Kill, now);
            }
            (Phase::Running, Asked::No) => {
                // Only on the way to the planned end do further steps buy further time.
                let on_the_way = self.cause.is_none() && self.plan.timing.steps.is_some_and(|planned| slot.steps() < planned);
                let progress = if on_the_way { slot.progress } else { self.begun };
                let late = self.finishing.is_some_and(|f| now.saturating_duration_since(f.max(progress)) > self.options.grace);
                if late && !slot.plan.records {
                    slot.ask(Asked::Stop, now);
                    let text = format!("`{}` has not ended with the others; it is stopped", slot.plan.label());
                    self.tell(1, "node_late", text);
                } else if !slot.silent && now.saturating_duration_since(slot.heard) > SILENCE {
                    let stopped = slot.child.as_ref().map(Child::pid).filter(|pid| ProcStat::of(*pid).is_some_and(|s| s.is_stopped()));
                    let text = match stopped {
                        Some(pid) => format!("`{}` has been stopped (SIGSTOP); `kill -CONT {pid}` continues it", slot.plan.label()),
                        None if self.plan.realtime() => {
                            format!("`{}` has not responded for {} s; it may hang", slot.plan.label(), SILENCE.as_secs())
                        }
                        None => return,
                    };
                    slot.silent = true;
                    self.tell(1, "node_silent", text);
                }
            }
            _ => {}
        }
    }
}
