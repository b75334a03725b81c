//! Drives the stages of one node over a transport, in either clock.
//!
//! One rule for both: at step k a stage waits until all its inputs for k are there, or, in real time,
//! until one period has passed since it could have begun; then it steps with what it has. In real time
//! it does not begin step k before `t0 + k * period`. A stage that is late (the machine was elsewhere)
//! does its late steps one after the other, each with its own inputs, so a hold-up of the whole machine
//! costs no sample; only beyond [`Options::horizon_s`] does it go on at the step now due, and says so.

use crate::book::{Book, Health, NO_VALUE, Wanted, gains_are_valid};
use crate::clock::{Start, now_ns, sleep_until_ns};
use crate::histogram::Histogram;
use crate::input::Input;
use crate::protocol::{MarginStatus, NodeStatus};
use crate::sentences::sentence;
use crate::stage::{Clock, NodePlan, PACE_PORT, Timing};
use crate::transport::{Publisher, Subscriber, Transport, TransportError};
use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_msgs::text::Text;
use backdrive_msgs::topic::Topic;
use backdrive_msgs::{Gains, LAYOUT, Message, Sample};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Why a node cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A transport does not do what it must.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// Lockstep: an input has not come.
    #[error("step {step}: nothing on {} within {timeout_s} s; has its node stopped?", topics.join(", "))]
    PeerTimeout {
        /// The step that could not be done.
        step: u64,
        /// What it waits for.
        topics: Vec<String>,
        /// How long it waited, s.
        timeout_s: f64,
    },
    /// Lockstep: samples were lost on the way, so the run is not what the graph says.
    #[error("step {step}: {lost} samples lost on {topic}")]
    Lost {
        /// The step at which it was seen.
        step: u64,
        /// Where.
        topic: String,
        /// How many.
        lost: u64,
    },
    /// The plan cannot be run.
    #[error("node `{node}`: {reason}")]
    Plan {
        /// The node.
        node: String,
        /// What is wrong.
        reason: String,
    },
    /// A recording lacks messages.
    #[error("{lost} messages lost; the bag says of which topics")]
    Incomplete {
        /// How many.
        lost: u64,
    },
    /// A bag cannot be written.
    #[error("{0}")]
    Bag(String),
}

impl RunError {
    /// The exit code that belongs to it: 3 bad input, 4 lost data, 5 the run broke down.
    pub fn code(&self) -> u8 {
        match self {
            RunError::Plan { .. } => 3,
            RunError::Lost { .. } | RunError::Incomplete { .. } => 4,
            RunError::Transport(_) | RunError::PeerTimeout { .. } | RunError::Bag(_) => 5,
        }
    }
}

/// How a node runs, beyond what the graph says.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Real time: a stage that is further behind than this, s, skips to the step that is due. Long
    /// enough for what a busy virtual machine withholds in a piece, short enough that forces are never
    /// computed from a time that the hand has left.
    pub horizon_s: f64,
    /// Listeners that each topic should have before the run may start, by name of the topic.
    pub listeners: BTreeMap<String, usize>,
}

impl Default for Options {
    fn default() -> Options {
        Options { horizon_s: 0.25, listeners: BTreeMap::new() }
    }
}

/// How other threads reach a node that runs.
#[derive(Debug, Default)]
pub struct Control {
    stop: AtomicBool,
    has_gains: AtomicBool,
    gains: Mutex<Vec<Gains>>,
}

impl Control {
    /// Ends the run after the step at hand.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::SeqCst);
    }

    /// Whether [`Control::stop`] was called.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Wants other gains from the next step on: scales without unit, and a ramp in s.
    pub fn set_gains(&self, mu: f64, lambda: f64, ramp_s: f64) {
        let gains = Gains { layout: LAYOUT, source: 0, step: 0, sequence: 0, stamp_ns: 0, mu, lambda, ramp_s };
        self.gains.lock().unwrap_or_else(PoisonError::into_inner).push(gains);
        self.has_gains.store(true, Ordering::SeqCst);
    }
}

/// What a running node tells whoever watches it. Small and without a heap, for it is told while stepping.
#[derive(Debug, Clone, Copy)]
pub enum Told {
    /// An event, as it is published.
    Event(backdrive_msgs::Event),
    /// About ten times a second of real time.
    Status(Report),
}

/// The numbers of a [`NodeStatus`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Report {
    /// As in [`NodeStatus`].
    pub steps: u64,
    /// As in [`NodeStatus`].
    pub missed_deadlines: u64,
    /// As in [`NodeStatus`].
    pub lost: u64,
    /// As in [`NodeStatus`].
    pub loop_p50_us: f64,
    /// As in [`NodeStatus`].
    pub loop_p99_us: f64,
    /// As in [`NodeStatus`].
    pub peak_effort: f64,
    /// As in [`NodeStatus`].
    pub recorded: Option<(u64, u64)>,
    /// As in [`NodeStatus`].
    pub margin: Option<MarginStatus>,
}

impl From<Report> for NodeStatus {
    fn from(r: Report) -> NodeStatus {
        let Report { steps, missed_deadlines, lost, loop_p50_us, loop_p99_us, peak_effort, recorded, margin } = r;
        NodeStatus { steps, missed_deadlines, lost, loop_p50_us, loop_p99_us, peak_effort, recorded, margin }
    }
}

/// Longest time without a look at [`Control`], ns.
const SLICE_NS: i64 = 20_000_000;
const REPORT_EVERY_NS: i64 = 100_000_000;

struct Output {
    publisher: Box<dyn Publisher>,
    topic: Topic,
    axes: usize,
    sequence: u64,
}

struct Stage {
    inputs: Vec<Input>,
    satisfied: Vec<bool>,
    ports: Vec<Port>,
    outputs: Vec<Output>,
    samples: Vec<Sample>,
    core: Box<dyn Core>,
    wanted: Wanted,
    step: u64,
    /// When the step at hand could begin, ns.
    waiting_since: i64,
}

/// A node whose publishers and subscribers exist.
pub struct Runner {
    name: String,
    timing: Timing,
    options: Options,
    stages: Vec<Stage>,
    teller: Teller,
    gains_in: Option<Box<dyn Subscriber>>,
    gains_out: Option<Output>,
    margin_out: Option<Output>,
    loop_time: Histogram,
    loop_time_recent: Histogram,
    skipped: u64,
    reported_at: i64,
    /// Late samples that were told, and when, ns.
    late_told: (u64, i64),
    /// Last, so that it outlives the ports that came from it.
    transport: Box<dyn Transport>,
}

/// Publishes events and status, and passes them on to whoever watches.
struct Teller {
    book: Book,
    events: Output,
    status: Output,
    noted: Events,
    report: Report,
    /// When a broken connection was last told, ns: once a second is enough.
    broken_told_at: i64,
}

impl Runner {
    /// Makes the node's publishers and subscribers.
    ///
    /// # Errors
    /// The plan has no stage or an impossible rate, or the transport refuses.
    pub fn new(plan: NodePlan, timing: &Timing, mut transport: Box<dyn Transport>, options: Options) -> Result<Runner, RunError> {
        let refuse = |reason: String| RunError::Plan { node: plan.name.clone(), reason };
        if plan.stages.is_empty() {
            return Err(refuse("it has no stage".into()));
        }
        if !(timing.rate_hz.is_finite() && timing.rate_hz > 0.0) {
            return Err(refuse(format!("a rate of {} Hz cannot be kept", timing.rate_hz)));
        }
        let expected = |topic: &Topic| options.listeners.get(&topic.name).copied().unwrap_or(0);
        let mut output = |topic: &Topic, axes: usize| -> Result<Output, TransportError> {
            Ok(Output { publisher: transport.publisher(topic, expected(topic))?, topic: topic.clone(), axes, sequence: 0 })
        };
        let mut stages = Vec::new();
        for stage in plan.stages {
            let outputs = stage.outputs.iter().map(|o| output(&o.topic, o.axes)).collect::<Result<Vec<_>, _>>()?;
            stages.push((stage, outputs));
        }
        let (events, status) = (output(&plan.events, 0)?, output(&plan.status, 0)?);
        let gains_out = plan.gains_out.as_ref().map(|t| output(t, 0)).transpose()?;
        let margin_out = plan.margin_out.as_ref().map(|t| output(t, 0)).transpose()?;
        let stages = stages
            .into_iter()
            .map(|(stage, outputs)| {
                let mut inputs = Vec::new();
                for port in &stage.inputs {
                    let subscriber = transport.subscriber(&port.topic, usize::MAX, true)?;
                    inputs.push(Input::new(port, timing.rate_hz, port.name == PACE_PORT, subscriber));
                }
                Ok(Stage {
                    satisfied: vec![false; inputs.len()],
                    ports: vec![Port::EMPTY; inputs.iter().filter(|i| !i.is_gate).count()],
                    inputs,
                    samples: outputs.iter().map(|o| Sample::new(o.axes)).collect(),
                    outputs,
                    core: stage.core,
                    wanted: Wanted::default(),
                    step: 0,
                    waiting_since: 0,
                })
            })
            .collect::<Result<Vec<_>, TransportError>>()?;
        let gains_in = plan.gains_in.as_ref().map(|t| transport.subscriber(t, 64, false)).transpose()?;
        let book = Book::new(&plan.name, timing);
        Ok(Runner {
            name: plan.name,
            timing: timing.clone(),
            options,
            stages,
            teller: Teller { book, events, status, noted: Events::default(), report: Report::default(), broken_told_at: i64::MIN },
            gains_in,
            gains_out,
            margin_out,
            loop_time: Histogram::default(),
            loop_time_recent: Histogram::default(),
            skipped: 0,
            reported_at: 0,
            late_told: (0, 0),
            transport,
        })
    }

    /// The node's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What it still lacks before it can start, one line each.
    pub fn missing(&self) -> Vec<String> {
        let inputs = self.stages.iter().flat_map(|s| &s.inputs);
        let mut lines: Vec<String> = inputs.filter(|i| !i.has_publisher()).map(|i| format!("{}: no publisher", i.topic)).collect();
        let told = [&self.teller.events, &self.teller.status].into_iter().chain(&self.gains_out).chain(&self.margin_out);
        let outputs = self.stages.iter().flat_map(|s| &s.outputs).chain(told);
        for output in outputs {
            let (has, expected) = (output.publisher.listeners(), self.options.listeners.get(&output.topic.name).copied().unwrap_or(0));
            if has < expected {
                lines.push(format!("{}: {has} of {expected} listeners", output.topic.name));
            }
        }
        lines
    }

    /// Something happened before the run: published at step 0. The text may hold what a person should know.
    pub fn note(&mut self, kind: &'static str, severity: u32, text: &str, tell: &mut dyn FnMut(Told)) {
        self.teller.tell_event(0, 0, kind, NO_VALUE, severity, Text::new(text), tell);
    }

    /// Runs until all steps are done or `control` stops it; tells events and reports on the way, and
    /// returns the figures of the whole run.
    ///
    /// # Errors
    /// In lockstep a missing input or a lost sample; in either clock a transport that fails for good.
    pub fn run(&mut self, start: Start, control: &Arc<Control>, tell: &mut dyn FnMut(Told)) -> Result<NodeStatus, RunError> {
        self.reported_at = now_ns();
        match self.timing.clock {
            Clock::Lockstep => self.run_lockstep(control, tell)?,
            Clock::Realtime => self.run_realtime(start, control, tell)?,
        }
        let peak_effort = self.teller.report.peak_effort;
        let report = self.report(&self.loop_time);
        Ok(Report { peak_effort, ..report }.into())
    }

    fn run_lockstep(&mut self, control: &Control, tell: &mut dyn FnMut(Told)) -> Result<(), RunError> {
        let steps = self.timing.steps.unwrap_or(u64::MAX);
        let timeout_ns = (self.timing.peer_timeout_s * 1e9) as i64;
        let begun = now_ns();
        self.stages.iter_mut().for_each(|s| s.waiting_since = begun);
        while !control.is_stopped() {
            self.take_gains(control);
            let (mut stepped, mut finished) = (false, true);
            for i in 0..self.stages.len() {
                let stage = &mut self.stages[i];
                if stage.step >= steps {
                    continue;
                }
                finished = false;
                if stage.poll()? {
                    let stamp = self.teller.book.simulated_ns(stage.step);
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

    fn run_realtime(&mut self, start: Start, control: &Control, tell: &mut dyn FnMut(Told)) -> Result<(), RunError> {
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
            let text = sentence("joined_late", first as f64);
            self.teller.tell_event(first, unix(begun), "joined_late", first as f64, 0, text, tell);
        }
        while !control.is_stopped() {
            self.take_gains(control);
            let mut now = now_ns();
            let (mut wake_at, mut waits_for_input, mut finished) = (now + SLICE_NS, false, true);
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
                    self.skipped += to - from;
                    let value = (to - from) as f64;
                    self.teller.tell_event(to, unix(now), "steps_skipped", value, 1, sentence("steps_skipped", value), tell);
                    wake_at = now;
                    continue;
                }
                let ready = match stage.poll() {
                    Ok(ready) => ready,
                    Err(e) => self.teller.tell_broken(stage.step, unix(now), &e, tell),
                };
                let give_up = stage.waiting_since + period_ns as i64;
                if !ready && now < give_up {
                    (waits_for_input, wake_at) = (true, wake_at.min(give_up));
                    continue;
                }
                if let Err(e) = self.do_step(i, unix(now), tell) {
                    self.teller.tell_broken(self.stages[i].step, unix(now), &e, tell);
                }
                now = now_ns();
                let stage = &mut self.stages[i];
                let next_due = due_ns(stage.step);
                self.teller.report.missed_deadlines += u64::from(now > next_due);
                stage.waiting_since = now.max(next_due);
                wake_at = wake_at.min(next_due);
            }
            if finished {
                break;
            }
            self.report_if_due(now, tell);
            self.tell_late(now, unix(now), tell);
            if wake_at <= now {
                continue;
            }
            match waits_for_input {
                true => self.transport.wait(Duration::from_nanos((wake_at - now) as u64))?,
                false => sleep_until_ns(wake_at),
            }
        }
        self.teller.report.missed_deadlines += self.skipped;
        Ok(())
    }

    /// Does the step at hand of a stage and sends what comes of it.
    fn do_step(&mut self, index: usize, stamp_ns: i64, tell: &mut dyn FnMut(Told)) -> Result<(), TransportError> {
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

    /// A lockstep run that lost a sample is not the run that the graph describes.
    fn refuse_losses(&mut self, index: usize, tell: &mut dyn FnMut(Told)) -> Result<(), RunError> {
        let stage = &self.stages[index];
        let Some(input) = stage.inputs.iter().find(|i| i.lost > 0) else {
            return Ok(());
        };
        let (step, topic, lost) = (stage.step - 1, input.topic.clone(), input.lost);
        let stamp = self.teller.book.simulated_ns(step);
        self.teller.tell_event(step, stamp, "samples_lost", lost as f64, 2, sentence("samples_lost", lost as f64), tell);
        Err(RunError::Lost { step, topic, lost })
    }

    fn peer_timeout(&mut self, steps: u64, tell: &mut dyn FnMut(Told)) -> Result<(), RunError> {
        let stuck = self.stages.iter().filter(|s| s.step < steps);
        let step = stuck.clone().map(|s| s.step).min().unwrap_or(0);
        let missing = stuck.flat_map(|s| s.inputs.iter().zip(&s.satisfied)).filter(|(_, satisfied)| !**satisfied);
        let topics: Vec<String> = missing.map(|(i, _)| i.topic.clone()).collect();
        let timeout_s = self.timing.peer_timeout_s;
        let stamp = self.teller.book.simulated_ns(step);
        self.teller.tell_event(step, stamp, "peer_timeout", timeout_s, 2, sentence("peer_timeout", timeout_s), tell);
        Err(RunError::PeerTimeout { step, topics, timeout_s })
    }

    /// Gains that the supervisor or a topic wants.
    fn take_gains(&mut self, control: &Control) {
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

    fn report_if_due(&mut self, now: i64, tell: &mut dyn FnMut(Told)) {
        if now - self.reported_at < REPORT_EVERY_NS {
            return;
        }
        self.reported_at = now;
        tell(Told::Status(self.report(&self.loop_time_recent)));
        self.teller.report.peak_effort = 0.0;
        self.loop_time_recent.clear();
    }

    /// Once a second, how many samples came too late to be used.
    fn tell_late(&mut self, now: i64, stamp_ns: i64, tell: &mut dyn FnMut(Told)) {
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

    fn report(&self, times: &Histogram) -> Report {
        let us = |q: f64| times.quantile(q) * 1e-3;
        Report { lost: lost(&self.stages), loop_p50_us: us(0.5), loop_p99_us: us(0.99), ..self.teller.report }
    }
}

impl Stage {
    /// Takes in what has arrived, and tells whether the step at hand can be done with it.
    fn poll(&mut self) -> Result<bool, TransportError> {
        let mut ready = true;
        for (input, satisfied) in self.inputs.iter_mut().zip(&mut self.satisfied) {
            *satisfied = input.poll(self.step)?;
            input.set_awaited(!*satisfied);
            ready &= *satisfied || !input.is_worth_waiting_for();
        }
        Ok(ready)
    }
}

impl Teller {
    fn drain(&mut self, step: u64, stamp_ns: i64, tell: &mut dyn FnMut(Told)) {
        let Teller { book, events, noted, .. } = self;
        book.drain(step, stamp_ns, noted, |_, event| {
            // An event that cannot be published is still told.
            let _ = events.publisher.send(&Message::Event(event));
            tell(Told::Event(event));
        });
    }

    #[allow(clippy::too_many_arguments)]
    fn tell_event(
        &mut self,
        step: u64,
        stamp_ns: i64,
        kind: &'static str,
        value: f64,
        severity: u32,
        text: Text<128>,
        tell: &mut dyn FnMut(Told),
    ) {
        let event = self.book.event(step, stamp_ns, kind, value, severity, text);
        let _ = self.events.publisher.send(&Message::Event(event));
        tell(Told::Event(event));
    }

    /// Real time goes on without a message that could not be moved. Returns "not ready".
    fn tell_broken(&mut self, step: u64, stamp_ns: i64, error: &TransportError, tell: &mut dyn FnMut(Told)) -> bool {
        if stamp_ns.saturating_sub(self.broken_told_at) >= 1_000_000_000 {
            self.broken_told_at = stamp_ns;
            self.tell_event(step, stamp_ns, "connection_broken", NO_VALUE, 2, Text::new(&error.to_string()), tell);
        }
        false
    }
}

fn lost(stages: &[Stage]) -> u64 {
    stages.iter().flat_map(|s| &s.inputs).map(|i| i.lost).sum()
}

fn want(stages: &mut [Stage], gains: Gains) {
    if gains_are_valid(&gains) {
        stages.iter_mut().for_each(|s| s.wanted.push(gains));
    }
}
