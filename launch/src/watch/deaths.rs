//! Nodes that have ended.

use super::state::Supervisor;
use super::times::seconds_since;
use crate::child::End;
use crate::error::LaunchError;
use crate::options::OnDeath;
use crate::report::{Cause, Death};
use crate::slot::{Asked, Phase};
use std::time::{Duration, Instant};

/// First pause before a node is started again; it doubles each time.
const BACKOFF: Duration = Duration::from_millis(100);

/// Longest pause before a node is started again.
const LONGEST_BACKOFF: Duration = Duration::from_secs(2);

impl Supervisor {
    pub(crate) fn ended(&mut self, index: usize, end: End, now: Instant) {
        let started = self.start.is_some();
        let early = self.is_early(index, now);
        let slot = &mut self.slots[index];
        slot.child = None;
        let name = slot.plan.label();
        let asked = slot.asked;
        if early && started && end.signal.is_none() {
            self.died(index, end, now);
        } else if !early && slot.done && end.signal.is_none() || asked >= Asked::Stop && slot.failed.is_none() && end.code == Some(0) {
            slot.end = if slot.done { "done" } else { "stopped" }.to_string();
            slot.enter(Phase::Ended, now);
            self.one_is_done(index, now);
        } else if slot.failed.is_none() && asked >= Asked::Term && end.signal.is_some() {
            slot.end = "did not end when asked, and was killed".to_string();
            slot.enter(Phase::Ended, now);
            self.killed.push(name.clone());
            if !self.killing {
                self.tell(1, "node_killed", format!("`{name}` did not end when asked, and was killed"));
            }
        } else if !started {
            slot.enter(Phase::Ended, now);
            let how = slot.how(end);
            let stderr = slot.stderr.iter().cloned().collect();
            let error = match slot.failed.clone() {
                Some((error, code)) => LaunchError::NodeFailed { node: name, error, code },
                None => LaunchError::DiedAtStart { node: name, how: how.clone(), stderr },
            };
            slot.end = how;
            if !self.stopping {
                self.give_up(error);
            }
        } else if self.stopping && !slot.plan.records && end.signal.is_none() {
            // One that has lost its peers because the run ends is no death of its own.
            slot.end = slot.how(end);
            slot.enter(Phase::Ended, now);
        } else {
            self.died(index, end, now);
        }
    }

    /// Whether a node that reports that it is done has ended before its time although nobody asked. Either somebody sent it a signal, or it is a
    /// program that decides on its own end. In lockstep the others end with it, as with one that is done.
    fn is_early(&self, index: usize, now: Instant) -> bool {
        let slot = &self.slots[index];
        if !slot.done || slot.asked != Asked::No || self.stopping || self.finishing.is_some() {
            return false;
        }
        if self.start.is_none() {
            return true;
        }
        match self.plan.timing.steps {
            // Without a planned end a recorder goes when it is asked to.
            None => slot.plan.records,
            Some(planned) if slot.steps() >= planned => false,
            // One that was held up over the end of the run has left out its last steps.
            Some(_) if self.plan.realtime() => self.planned_end().is_some_and(|end| now < end),
            Some(_) => slot.plan.records,
        }
    }

    pub(crate) fn died(&mut self, index: usize, end: End, now: Instant) {
        let realtime = self.plan.realtime();
        let t_s = self.start.map_or(0.0, |s| seconds_since(now, s.at));
        let slot = &mut self.slots[index];
        let name = slot.plan.label();
        let how = if slot.failed.is_some() { format!("failed: {}", slot.how(end)) } else { slot.how(end) };
        self.deaths.push(Death {
            node: name.clone(),
            t_s,
            steps: slot.steps(),
            how: how.clone(),
            code: end.code,
            signal: end.signal,
            stderr: std::mem::take(&mut slot.stderr).into(),
            recovered: false,
        });
        let again = realtime
            && slot.plan.restart
            && !slot.plan.records
            && !self.stopping
            && self.finishing.is_none()
            && slot.restarts < self.options.max_restarts;
        if again {
            let pause = BACKOFF.saturating_mul(1 << slot.restarts.min(16)).min(LONGEST_BACKOFF);
            slot.restarts += 1;
            slot.enter(Phase::Backoff { until: now + pause }, now);
            return self.tell(2, "node_died", format!("`{name}` {how}; it is started again"));
        }
        slot.end = how.clone();
        let cause = match slot.failed.clone() {
            Some((error, code)) => Cause::NodeFailed { node: name.clone(), error, code },
            None => Cause::NodeDied { node: name.clone(), how: how.clone() },
        };
        let records = slot.plan.records;
        slot.enter(Phase::Ended, now);
        self.loss.get_or_insert(cause.clone());
        let stops = !realtime
            || match self.options.on_death {
                OnDeath::Auto => records,
                OnDeath::Stop => true,
                OnDeath::Continue => false,
            };
        let others = match (self.stopping || self.finished.is_some(), stops) {
            (true, _) => "",
            (false, true) => "; the run stops",
            (false, false) => "; the others go on without it",
        };
        self.tell(2, "node_died", format!("`{name}` {how}{others}"));
        if stops {
            self.stop(cause);
        }
    }

    /// In lockstep, or where the end is planned, the others should be done soon too.
    fn one_is_done(&mut self, index: usize, now: Instant) {
        let slot = &self.slots[index];
        if slot.plan.records || self.stopping || self.start.is_none() {
            return;
        }
        let (name, steps) = (slot.plan.label(), slot.steps());
        if !self.plan.realtime() && self.plan.timing.steps.is_none_or(|planned| steps < planned) {
            self.tell(1, "ended_early", format!("`{name}` ended on its own after {steps} steps, and the others with it"));
            self.cause.get_or_insert(Cause::EndedEarly { node: name, steps });
        }
        if !self.plan.realtime() || self.plan.timing.steps.is_some_and(|planned| steps >= planned) {
            self.finishing.get_or_insert(now);
        }
    }
}
