//! One step of a stage, and the report on the steps.

use super::control::{Asked, Control, Told};
use super::stage::{lost, refused, want};
use super::state::Runner;
use crate::book::{Health, NO_VALUE};
use crate::clock::now_ns;
use crate::input::Input;
use crate::protocol::{MarginStatus, Note};
use crate::sentences::sentence;
use crate::transport::TransportError;
use backdrive_control::core::Tick;
use backdrive_msgs::text::Text;
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
        let member = &mut self.members[stage.member];
        stage.core.step(&tick, &stage.ports, &mut stage.samples, &mut member.teller.noted);
        stage.step += 1;

        // Reports are sent before the samples: a recorder that has the last sample has all of it.
        member.teller.drain(step, stamp_ns, tell);
        let mut first_error = Ok(());
        if stage.is_first {
            let which = stage.member;
            member.teller.report.steps = step + 1;
            first_error = self.publish_status(which, step, stamp_ns);
        }
        let stage = &mut self.stages[index];
        let member = &mut self.members[stage.member];
        if let (Some(output), Some(now)) = (&mut member.gains_out, stage.core.gains())
            && let Some(gains) = member.teller.book.gains(step, stamp_ns, now)
        {
            first_error = first_error.and(output.publisher.send(&Message::Gains(gains)));
        }
        if let Some(output) = &mut member.margin_out
            && let Some(margin) = member.teller.book.margin(step, stamp_ns, || stage.core.margin())
        {
            member.teller.report.margin = Some(MarginStatus::from(&margin));
            first_error = first_error.and(output.publisher.send(&Message::Margin(margin)));
        }
        if stage.is_first && step >= member.lists_due {
            member.lists_due = step + (self.timing.rate_hz / LISTS_HZ).ceil() as u64;
            for (index, output) in member.lists.iter_mut().enumerate() {
                let Some(values) = stage.core.report(index) else { continue };
                let mut list = Sample { position: values, source: member.teller.book.source, step, stamp_ns, ..Sample::new(output.axes) };
                (list.layout, list.sequence) = (LAYOUT, output.sequence);
                output.sequence += 1;
                first_error = first_error.and(output.publisher.send(&Message::Sample(list)));
            }
        }
        for (sample, output) in stage.samples.iter_mut().zip(&mut stage.outputs) {
            (sample.layout, sample.source) = (LAYOUT, member.teller.book.source);
            (sample.step, sample.sequence, sample.stamp_ns) = (step, output.sequence, stamp_ns);
            output.sequence += 1;
            let effort = sample.effort[..sample.len()].iter().fold(0.0, |peak: f64, e| peak.max(e.abs()));
            member.teller.report.peak_effort = member.teller.report.peak_effort.max(effort);
            first_error = first_error.and(output.publisher.send(&Message::Sample(*sample)));
        }
        let now = now_ns();
        let took = (now - stage.waiting_since).max(0) as u64;
        stage.waiting_since = now;
        member.loop_time.record(took);
        member.loop_time_recent.record(took);
        first_error
    }

    fn publish_status(&mut self, index: usize, step: u64, stamp_ns: i64) -> Result<(), TransportError> {
        let member = &mut self.members[index];
        let health = || Health {
            missed_deadlines: member.teller.report.missed_deadlines + member.skipped,
            lost: lost(&self.stages, index),
            loop_p50_s: member.loop_time_recent.quantile(0.5) * 1e-9,
            loop_p99_s: member.loop_time_recent.quantile(0.99) * 1e-9,
        };
        match member.teller.book.status(step, stamp_ns, health) {
            Some(status) => member.teller.status.publisher.send(&Message::Status(status)),
            None => Ok(()),
        }
    }

    /// Gains that the supervisor or a topic wants. Which members a stranger would have given some, with the report on it.
    pub(super) fn take_gains(&mut self, control: &Control) -> Vec<(usize, TransportError)> {
        let mut strangers = Vec::new();
        if control.has_gains.swap(false, Ordering::Relaxed) {
            let alone = self.members.len() == 1;
            for gains in control.gains.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
                // Of several nodes only the one hears of them that would hear of them in a process of its own.
                let hearing = self.members.iter().enumerate().filter(|(_, m)| alone || m.gains_out.is_some());
                hearing.for_each(|(index, _)| want(&mut self.stages, index, gains));
            }
        }
        for (index, member) in self.members.iter_mut().enumerate() {
            let Some(subscriber) = &mut member.gains_in else { continue };
            // A broken message here must not end the loop: the gains simply stay.
            loop {
                match subscriber.receive() {
                    Ok(Some(Message::Gains(gains))) => want(&mut self.stages, index, gains),
                    Err(e @ TransportError::Stranger { .. }) => break strangers.push((index, e)),
                    Ok(_) | Err(_) => break,
                }
            }
        }
        strangers
    }

    /// What else the supervisor asks for: switches, and events of others, which the first node publishes at the step of its first stage.
    pub(super) fn take_asked(&mut self, control: &Control, stamp: impl Fn(u64) -> i64, tell: &mut dyn FnMut(Told)) {
        if !control.has_asked.swap(false, Ordering::Relaxed) {
            return;
        }
        let asked = std::mem::take(&mut *control.asked.lock().unwrap_or_else(PoisonError::into_inner));
        let step = self.stages.iter().find(|s| s.member == 0).map_or(0, |s| s.step);
        for asked in asked {
            match asked {
                Asked::Canceller(on, ramp_s) => self.stages.iter_mut().for_each(|s| s.core.set_active(on, ramp_s)),
                Asked::Note(Note { severity, kind, text, value }) => {
                    if let Some(member) = self.members.first_mut() {
                        let value = value.unwrap_or(NO_VALUE);
                        member.teller.tell_event(step, stamp(step), &kind, value, severity, Text::new(&text), tell);
                    }
                }
            }
        }
    }

    pub(super) fn report_if_due(&mut self, now: i64, tell: &mut dyn FnMut(Told)) {
        if now - self.reported_at < REPORT_EVERY_NS {
            return;
        }
        self.reported_at = now;
        for (index, member) in self.members.iter_mut().enumerate() {
            let status = member.report((lost(&self.stages, index), refused(&self.stages, index)), &member.loop_time_recent);
            tell(Told::Status { source: member.teller.book.source, status });
            member.teller.report.peak_effort = 0.0;
            member.loop_time_recent.clear();
            // What is sent rarely, such as the gains in force, reaches who joins late only where its publisher looks for new listeners.
            for output in member.side_outputs() {
                let _ = output.publisher.listeners();
            }
        }
    }

    /// Once a second, how many samples came too late to be used.
    pub(super) fn tell_late(&mut self, now: i64, stamp_ns: i64, tell: &mut dyn FnMut(Told)) {
        for (index, member) in self.members.iter_mut().enumerate() {
            if now - member.late_told.1 < 1_000_000_000 {
                continue;
            }
            let stages = || self.stages.iter().filter(|s| s.member == index);
            let late: u64 = stages().flat_map(|s| &s.inputs).map(Input::late).sum();
            let (value, step) = ((late - member.late_told.0) as f64, stages().next().map_or(0, |s| s.step));
            member.late_told = (late, now);
            if value > 0.0 {
                member.teller.tell_event(step, stamp_ns, "samples_late", value, 1, sentence("samples_late", value), tell);
            }
        }
    }
}

const REPORT_EVERY_NS: i64 = 100_000_000;

/// Lists of named numbers per second.
const LISTS_HZ: f64 = 10.0;
