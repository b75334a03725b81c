//! All steps in lockstep: none without its inputs.

use super::control::{Control, SLICE_NS, Told};
use super::error::RunError;
use super::state::Runner;
use crate::book::simulated_ns;
use crate::clock::now_ns;
use crate::sentences::sentence;
use crate::transport::TransportError;
use std::time::Duration;

impl Runner {
    pub(super) fn run_lockstep(&mut self, control: &Control, tell: &mut dyn FnMut(Told)) -> Result<(), RunError> {
        let steps = self.timing.steps.unwrap_or(u64::MAX);
        let timeout_ns = (self.timing.peer_timeout_s * 1e9) as i64;
        let begun = now_ns();
        self.stages.iter_mut().for_each(|s| s.waiting_since = begun);
        while !control.is_stopped() {
            for (member, e) in self.take_gains(control) {
                let step = self.stages.iter().find(|s| s.member == member).map_or(0, |s| s.step);
                let teller = &mut self.members[member].teller;
                teller.tell_broken(step, teller.book.simulated_ns(step), &e, tell);
            }
            let rate_hz = self.timing.rate_hz;
            self.take_asked(control, |step| simulated_ns(step, rate_hz), tell);
            let (mut stepped, mut finished) = (false, true);
            for i in 0..self.stages.len() {
                let stage = &mut self.stages[i];
                if stage.step >= steps {
                    continue;
                }
                finished = false;
                let teller = &mut self.members[stage.member].teller;
                let stamp = teller.book.simulated_ns(stage.step);
                let ready = match stage.poll() {
                    Err(e @ TransportError::Stranger { .. }) => teller.tell_broken(stage.step, stamp, &e, tell),
                    polled => polled?,
                };
                if ready {
                    self.do_step(i, stamp, tell)?;
                    self.refuse_losses(i, tell)?;
                    stepped = true;
                }
            }
            if finished {
                break;
            }
            if stepped {
                self.report_if_due(now_ns(), tell);
                continue;
            }
            self.transport.wait(Duration::from_nanos(SLICE_NS as u64))?;
            let now = now_ns();
            self.report_if_due(now, tell);
            // All of them must be stuck: a stage may be done early and wait for its peers for long.
            let mut stuck = self.stages.iter().filter(|s| s.step < steps);
            if stuck.all(|s| now - s.waiting_since > timeout_ns) {
                return self.peer_timeout(steps, tell);
            }
        }
        Ok(())
    }

    /// A lockstep run that lost a sample is not the run that the graph describes.
    fn refuse_losses(&mut self, index: usize, tell: &mut dyn FnMut(Told)) -> Result<(), RunError> {
        let stage = &self.stages[index];
        let Some(input) = stage.inputs.iter().find(|i| i.lost > 0) else {
            return Ok(());
        };
        let (step, topic, lost) = (stage.step - 1, input.topic.clone(), input.lost);
        let teller = &mut self.members[stage.member].teller;
        let stamp = teller.book.simulated_ns(step);
        teller.tell_event(step, stamp, "samples_lost", lost as f64, 2, sentence("samples_lost", lost as f64), tell);
        Err(RunError::Lost { step, topic, lost })
    }

    fn peer_timeout(&mut self, steps: u64, tell: &mut dyn FnMut(Told)) -> Result<(), RunError> {
        let stuck = self.stages.iter().filter(|s| s.step < steps);
        let step = stuck.clone().map(|s| s.step).min().unwrap_or(0);
        let missing = stuck.flat_map(|s| s.inputs.iter().zip(&s.satisfied)).filter(|(_, satisfied)| !**satisfied);
        let topics: Vec<String> = missing.map(|(i, _)| i.topic.clone()).collect();
        let timeout_s = self.timing.peer_timeout_s;
        // Of nodes that share the process the one that is furthest behind reports it.
        let behind = self.stages.iter().filter(|s| s.step < steps).min_by_key(|s| s.step).map_or(0, |s| s.member);
        let teller = &mut self.members[behind].teller;
        let stamp = teller.book.simulated_ns(step);
        teller.tell_event(step, stamp, "peer_timeout", timeout_s, 2, sentence("peer_timeout", timeout_s), tell);
        Err(RunError::PeerTimeout { step, topics, timeout_s })
    }
}
