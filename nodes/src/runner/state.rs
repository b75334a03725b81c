//! A node whose publishers and subscribers exist.

use super::control::{Options, Told};
use super::error::RunError;
use super::stage::{Output, Stage};
use super::teller::Teller;
use crate::book::{Book, NO_VALUE, Wanted};
use crate::histogram::Histogram;
use crate::input::Input;
use crate::protocol::NodeStatus;
use crate::stage::{NodePlan, PACE_PORT, Timing};
use crate::transport::{Subscriber, Transport, TransportError};
use backdrive_control::core::{Events, Port};
use backdrive_msgs::Sample;
use backdrive_msgs::text::Text;
use backdrive_msgs::topic::Topic;

/// A node whose publishers and subscribers exist.
pub struct Runner {
    name: String,
    pub(super) timing: Timing,
    pub(super) options: Options,
    pub(super) stages: Vec<Stage>,
    pub(super) teller: Teller,
    pub(super) gains_in: Option<Box<dyn Subscriber>>,
    pub(super) gains_out: Option<Output>,
    pub(super) margin_out: Option<Output>,
    pub(super) loop_time: Histogram,
    pub(super) loop_time_recent: Histogram,
    pub(super) skipped: u64,
    pub(super) reported_at: i64,
    /// Late samples that were told, and when, ns.
    pub(super) late_told: (u64, i64),
    /// Last, so that it outlives the ports that came from it.
    pub(super) transport: Box<dyn Transport>,
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
            teller: Teller { book, events, status, noted: Events::default(), report: NodeStatus::default(), broken_told_at: i64::MIN },
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
}
