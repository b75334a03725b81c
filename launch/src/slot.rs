//! The place of a process in a run, over all lives of its process.

use crate::child::{Child, End};
use crate::member::Member;
use crate::pace::Pace;
use crate::plan::NodePlan;
use crate::proc_stat::ProcStat;
use backdrive_nodes::protocol::{NodeStatus, ToNode};
use nix::sys::signal::Signal;
use std::collections::VecDeque;
use std::time::Instant;

/// Lines of standard error that are kept for the report.
const LAST_LINES: usize = 20;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Started, not yet connected.
    Joining,
    /// Connected, not yet started.
    Ready,
    /// In the loop.
    Running,
    /// Dead, and to be started again.
    Backoff { until: Instant },
    /// Ended for good.
    Ended,
}

/// How far the supervisor has gone to end a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Asked {
    No,
    Stop,
    Term,
    Kill,
}

pub(crate) struct Slot {
    pub plan: NodePlan,
    pub child: Option<Child>,
    pub phase: Phase,
    /// Since when it has been in this phase.
    pub since: Instant,
    pub life: u32,
    pub restarts: u32,
    /// Whether this life has created its topics.
    pub created: bool,
    pub missing: Vec<String>,
    pub done: bool,
    /// Its message when it failed, and the exit code it asks for.
    pub failed: Option<(String, u8)>,
    pub asked: Asked,
    pub asked_at: Instant,
    /// The nodes of the process, at least one.
    pub members: Vec<Member>,
    /// When its steps last advanced.
    pub progress: Instant,
    /// When it was last heard.
    pub heard: Instant,
    pub silent: bool,
    /// The system's last information on the process, while the run ends, and when it was last seen to work.
    pub stat: Option<ProcStat>,
    pub worked: Instant,
    /// When it was continued, because it had been stopped.
    pub continued: Option<Instant>,
    pub stray: bool,
    pub stderr: VecDeque<String>,
    pub lines: Pace,
    pub events: Pace,
    pub end: String,
}

impl Slot {
    pub fn new(plan: NodePlan, now: Instant) -> Slot {
        let members = plan.nodes().map(Member::new).collect();
        Slot {
            plan,
            child: None,
            phase: Phase::Joining,
            since: now,
            life: 0,
            restarts: 0,
            created: false,
            missing: Vec::new(),
            done: false,
            failed: None,
            asked: Asked::No,
            asked_at: now,
            members,
            progress: now,
            heard: now,
            silent: false,
            stat: None,
            worked: now,
            continued: None,
            stray: false,
            stderr: VecDeque::new(),
            lines: Pace::new(20.0, 60.0, now),
            events: Pace::new(2.0, 10.0, now),
            end: String::new(),
        }
    }

    pub fn enter(&mut self, phase: Phase, now: Instant) {
        self.phase = phase;
        self.since = now;
    }

    /// A new process takes the place.
    pub fn begin(&mut self, child: Child, now: Instant) {
        self.members.iter_mut().for_each(Member::begin);
        self.child = Some(child);
        self.created = false;
        self.missing.clear();
        self.done = false;
        self.failed = None;
        self.asked = Asked::No;
        self.heard = now;
        self.progress = now;
        self.silent = false;
        (self.stat, self.worked, self.continued) = (None, now, None);
        self.enter(Phase::Joining, now);
    }

    pub fn ended(&self) -> bool {
        self.phase == Phase::Ended
    }

    pub fn tell(&self, words: &ToNode) {
        if let Some(child) = &self.child {
            child.tell(words);
        }
    }

    /// Goes one step further to end it; never back.
    pub fn ask(&mut self, asked: Asked, now: Instant) {
        if asked <= self.asked {
            return;
        }
        self.asked = asked;
        self.asked_at = now;
        let Some(child) = &self.child else { return };
        match asked {
            Asked::No => {}
            Asked::Stop => child.tell(&ToNode::Stop),
            Asked::Term => child.signal(Signal::SIGTERM),
            Asked::Kill => child.signal(Signal::SIGKILL),
        }
    }

    /// Takes the report of a node of the process on itself; one that it does not name is the first.
    pub fn take_status(&mut self, node: Option<&str>, status: NodeStatus, now: Instant) {
        let index = node.and_then(|name| self.members.iter().position(|m| m.node.name == name)).unwrap_or(0);
        if self.members.get_mut(index).is_some_and(|m| m.take_status(status, now)) {
            self.progress = now;
        }
    }

    /// Largest effort of the last second, N.
    pub fn recent_peak(&self, now: Instant) -> Option<f64> {
        self.members.iter().filter_map(|m| m.recent_peak(now)).reduce(f64::max)
    }

    pub fn steps(&self) -> u64 {
        self.members.first().and_then(|m| m.status.as_ref()).map_or(0, |s| s.steps)
    }

    /// How its process ended, by its own report or the system's.
    pub fn how(&self, end: End) -> String {
        match (&self.failed, self.done) {
            (Some((error, _)), _) => error.clone(),
            (None, true) => format!("ended on its own after {} steps", self.steps()),
            (None, false) => end.words(),
        }
    }

    pub fn wrote(&mut self, line: String) {
        self.stderr.push_back(line);
        if self.stderr.len() > LAST_LINES {
            self.stderr.pop_front();
        }
    }

    /// Why it is not ready, for a person.
    pub fn lack(&self) -> String {
        let name = self.plan.label();
        match (&self.missing[..], self.created) {
            ([], false) => format!("{name}: has not responded; does the program implement the node protocol?"),
            ([], true) => format!("{name}: is still connecting"),
            (missing, _) => format!("{name}: {}", missing.join("; ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_add_up_over_lives_and_steps_do_not_go_back() {
        let now = Instant::now();
        let mut slot = Slot::new(NodePlan::default(), now);
        slot.take_status(None, NodeStatus { steps: 90, lost: 2, missed_deadlines: 1, peak_effort: 5.0, ..NodeStatus::default() }, now);
        slot.members[0].before = (1, 2, 0);
        slot.take_status(None, NodeStatus { steps: 10, lost: 4, peak_effort: 3.0, ..NodeStatus::default() }, now);
        let status = slot.members[0].status.unwrap_or_default();
        assert_eq!((status.steps, status.lost, status.missed_deadlines, status.peak_effort), (90, 6, 1, 5.0));
        assert_eq!(slot.recent_peak(now), Some(5.0));
        assert_eq!(slot.recent_peak(now + std::time::Duration::from_secs(2)), None);
    }

    #[test]
    fn says_what_it_lacks() {
        let mut slot = Slot::new(NodePlan { name: "slave".to_string(), ..NodePlan::default() }, Instant::now());
        assert!(slot.lack().contains("not responded"));
        slot.created = true;
        assert!(slot.lack().contains("still connecting"));
        slot.missing = vec!["/a: no publisher".to_string(), "/b: no publisher".to_string()];
        assert_eq!(slot.lack(), "slave: /a: no publisher; /b: no publisher");
    }
}
