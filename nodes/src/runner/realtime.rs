//! All steps in real time: none later than the next one is due.

use super::control::{Control, SLICE_NS, Told};
use super::error::RunError;
use super::state::Runner;
use crate::clock::{Start, now_ns, poll_until_ns, sleep_until_ns};
use crate::input::Input;
use crate::sentences::sentence;
use std::time::Duration;

impl Runner {
    pub(super) fn run_realtime(&mut self, start: Start, control: &Control, tell: &mut dyn FnMut(Told)) -> Result<(), RunError> {
        let period_ns = 1e9 / self.timing.rate_hz;
        let due_ns = |step: u64| start.t0_ns + (step as f64 * period_ns) as i64;
        let steps = self.timing.steps.unwrap_or(u64::MAX);
        let horizon_ns = (self.options.horizon_s * 1e9) as i64;
        let unix = |now: i64| start.unix_at(now);
        let due_step = |now: i64| (((now - start.t0_ns).max(0) as f64) / period_ns).ceil() as u64;

        let begun = now_ns();
        let first = due_step(begun);
        for stage in &mut self.stages {
            (stage.step, stage.waiting_since) = (first, due_ns(first).max(begun));
        }
        if first > 0 {
            self.stages.iter_mut().flat_map(|s| &mut s.inputs).for_each(Input::join_late);
            for member in &mut self.members {
                let text = sentence("joined_late", first as f64);
                member.teller.tell_event(first, unix(begun), "joined_late", first as f64, 0, text, tell);
            }
        }
        while !control.is_stopped() {
            let mut now = now_ns();
            for (member, e) in self.take_gains(control) {
                let step = self.stages.iter().find(|s| s.member == member).map_or(0, |s| s.step);
                self.members[member].teller.tell_broken(step, unix(now), &e, tell);
            }
            self.take_asked(control, |_| unix(now), tell);
            let (mut wake_at, mut waits_for_input, mut finished, mut stepped) = (now + SLICE_NS, false, true, false);
            for i in 0..self.stages.len() {
                let stage = &mut self.stages[i];
                if stage.step >= steps {
                    continue;
                }
                finished = false;
                let due = due_ns(stage.step);
                if now < due {
                    wake_at = wake_at.min(due);
                    continue;
                }
                if now - due > horizon_ns {
                    let (to, from) = (due_step(now), stage.step);
                    (stage.step, stage.waiting_since) = (to, now);
                    let member = &mut self.members[stage.member];
                    member.skipped += to - from;
                    let value = (to - from) as f64;
                    member.teller.tell_event(to, unix(now), "steps_skipped", value, 1, sentence("steps_skipped", value), tell);
                    wake_at = now;
                    continue;
                }
                let ready = match stage.poll() {
                    Ok(ready) => ready,
                    Err(e) => self.members[stage.member].teller.tell_broken(stage.step, unix(now), &e, tell),
                };
                let give_up = stage.waiting_since + period_ns as i64;
                if !ready && now < give_up {
                    (waits_for_input, wake_at) = (true, wake_at.min(give_up));
                    continue;
                }
                let member = stage.member;
                if let Err(e) = self.do_step(i, unix(now), tell) {
                    self.members[member].teller.tell_broken(self.stages[i].step, unix(now), &e, tell);
                }
                stepped = true;
                now = now_ns();
                let stage = &mut self.stages[i];
                let next_due = due_ns(stage.step);
                self.members[member].teller.report.missed_deadlines += u64::from(now > next_due);
                stage.waiting_since = now.max(next_due);
                wake_at = wake_at.min(next_due);
            }
            if finished {
                break;
            }
            self.report_if_due(now, tell);
            self.tell_late(now, unix(now), tell);
            // What a stage has just sent may be what one of the same process waits for, and rings no bell.
            if wake_at <= now || stepped && waits_for_input {
                continue;
            }
            match waits_for_input {
                true => self.transport.wait(Duration::from_nanos((wake_at - now) as u64))?,
                false if self.options.polls => poll_until_ns(wake_at),
                false => sleep_until_ns(wake_at),
            }
        }
        for member in &mut self.members {
            member.teller.report.missed_deadlines += member.skipped;
        }
        Ok(())
    }
}
