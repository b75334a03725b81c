//! One step of a stage, and what is told of the steps.

use super::control::{Control, Told};
use super::stage::{lost, want};
use super::state::Runner;
use crate::book::Health;
use crate::clock::now_ns;
use crate::histogram::Histogram;
use crate::input::Input;
use crate::protocol::{MarginStatus, NodeStatus};
use crate::sentences::sentence;
use crate::transport::TransportError;
use backdrive_control::core::Tick;
use backdrive_msgs::{LAYOUT, Message, Sample};
use std::sync::PoisonError;
use std::sync::atomic::Ordering;

impl Runner {
    /// Does the step at hand of a stage and sends what comes of it.
    pub(super) fn do_step(&mut self, index: usize, stamp_ns: i64, tell: &mut dyn FnMut(Told)) -> Result<(), TransportError> {
        let stage = &mut self.stages[index];
        let step = stage.step;
        while let Some(gains) = stage.wanted.due(step) {
            stage.core.set_gains(&gains);
        }
        let seen = stage.inputs.iter_mut().zip(&stage.satisfied).filter(|(i, _)| !i.is_gate);
        for (port, (input, satisfied)) in stage.ports.iter_mut().zip(seen) {
            *port = input.port(step, *satisfied);
        }
        for (sample, output) in stage.samples.iter_mut().zip(&stage.outputs) {
            *sample = Sample::new(output.axes);
        }
        let period_s = 1.0 / self.timing.rate_hz;
        let tick = Tick { step, time_s: step as f64 * period_s, period_s };
        stage.core.step(&tick, &stage.ports, &mut stage.samples, &mut self.teller.noted);
        stage.step += 1;

        // What is told goes before the samples: a recorder that has the last sample has all of it.
        self.teller.drain(step, stamp_ns, tell);
        let mut first_error = Ok(());
        if index == 0 {
            self.teller.report.steps = step + 1;
            first_error = self.publish_status(step, stamp_ns);
        }
        let stage = &mut self.stages[index];
        if let (Some(output), Some(now)) = (&mut self.gains_out, stage.core.gains())
            && let Some(gains) = self.teller.book.gains(step, stamp_ns, now)
        {
            first_error = first_error.and(output.publisher.send(&Message::Gains(gains)));
        }
        if let Some(output) = &mut self.margin_out
            && let Some(margin) = self.teller.book.margin(step, stamp_ns, || stage.core.margin())
        {
            self.teller.report.margin = Some(MarginStatus::from(&margin));
            first_error = first_error.and(output.publisher.send(&Message::Margin(margin)));
        }
        for (sample, output) in stage.samples.iter_mut().zip(&mut stage.outputs) {
            (sample.layout, sample.source) = (LAYOUT, self.teller.book.source);
            (sample.step, sample.sequence, sample.stamp_ns) = (step, output.sequence, stamp_ns);
            output.sequence += 1;
            let effort = sample.effort[..sample.len()].iter().fold(0.0, |peak: f64, e| peak.max(e.abs()));
            self.teller.report.peak_effort = self.teller.report.peak_effort.max(effort);
            first_error = first_error.and(output.publisher.send(&Message::Sample(*sample)));
        }
        let now = now_ns();
        let took = (now - stage.waiting_since).max(0) as u64;
        stage.waiting_since = now;
        self.loop_time.record(took);
        self.loop_time_recent.record(took);
        first_error
    }

    fn publish_status(&mut self, step: u64, stamp_ns: i64) -> Result<(), TransportError> {
        let health = || Health {
            missed_deadlines: self.teller.report.missed_deadlines + self.skipped,
            lost: lost(&self.stages),
            loop_p50_s: self.loop_time_recent.quantile(0.5) * 1e-9,
            loop_p99_s: self.loop_time_recent.quantile(0.99) * 1e-9,
        };
        match self.teller.book.status(step, stamp_ns, health) {
            Some(status) => self.teller.status.publisher.send(&Message::Status(status)),
            None => Ok(()),
        }
    }

    /// Gains that the supervisor or a topic wants.
    pub(super) fn take_gains(&mut self, control: &Control) {
        if control.has_gains.swap(false, Ordering::Relaxed) {
            for gains in control.gains.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
                want(&mut self.stages, gains);
            }
        }
        if let Some(subscriber) = &mut self.gains_in {
            // A broken message here must not end the loop: the gains simply stay.
            while let Ok(Some(Message::Gains(gains))) = subscriber.receive() {
                want(&mut self.stages, gains);
            }
        }
    }

    pub(super) fn report_if_due(&mut self, now: i64, tell: &mut dyn FnMut(Told)) {
        if now - self.reported_at < REPORT_EVERY_NS {
            return;
        }
        self.reported_at = now;
        tell(Told::Status(self.report(&self.loop_time_recent)));
        self.teller.report.peak_effort = 0.0;
        self.loop_time_recent.clear();
    }

    /// Once a second, how many samples came too late to be used.
    pub(super) fn tell_late(&mut self, now: i64, stamp_ns: i64, tell: &mut dyn FnMut(Told)) {
        if now - self.late_told.1 < 1_000_000_000 {
            return;
        }
        let late: u64 = self.stages.iter().flat_map(|s| &s.inputs).map(Input::late).sum();
        let (value, step) = ((late - self.late_told.0) as f64, self.stages.first().map_or(0, |s| s.step));
        self.late_told = (late, now);
        if value > 0.0 {
            self.teller.tell_event(step, stamp_ns, "samples_late", value, 1, sentence("samples_late", value), tell);
        }
    }

    pub(super) fn report(&self, times: &Histogram) -> NodeStatus {
        let us = |q: f64| times.quantile(q) * 1e-3;
        NodeStatus { lost: lost(&self.stages), loop_p50_us: us(0.5), loop_p99_us: us(0.99), ..self.teller.report }
    }
}

const REPORT_EVERY_NS: i64 = 100_000_000;
