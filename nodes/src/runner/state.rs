//! Nodes whose publishers and subscribers exist.

use super::control::{Options, Told};
use super::error::RunError;
use super::member::Member;
use super::stage::{Output, Stage};
use super::teller::Teller;
use super::together::Together;
use crate::book::{Book, NO_VALUE, Wanted};
use crate::histogram::Histogram;
use crate::input::Input;
use crate::protocol::NodeStatus;
use crate::sequence::stage_order;
use crate::stage::{NodePlan, PACE_PORT, Timing};
use crate::transport::{Transport, TransportError};
use backdrive_control::core::{Events, Port};
use backdrive_msgs::Sample;
use backdrive_msgs::text::Text;
use backdrive_msgs::topic::Topic;

/// One node whose publishers and subscribers exist, or several that share a thread.
pub struct Runner {
    pub(super) timing: Timing,
    pub(super) options: Options,
    pub(super) members: Vec<Member>,
    /// Of all members, in the order in which they step.
    pub(super) stages: Vec<Stage>,
    pub(super) reported_at: i64,
    /// Last, so that it outlives the ports that came from it.
    pub(super) transport: Box<dyn Transport>,
}

impl Runner {
    /// Makes the node's publishers and subscribers.
    ///
    /// # Errors
    /// The plan has no stage or an impossible rate, or the transport refuses.
    pub fn new(plan: NodePlan, timing: &Timing, transport: Box<dyn Transport>, options: Options) -> Result<Runner, RunError> {
        Runner::together(vec![plan], timing, transport, options)
    }

    /// The same for several nodes, which step one after the other in this thread and hand each other their samples without the
    /// transport; it carries them to everyone else.
    ///
    /// # Errors
    /// As [`Runner::new`]; a topic with two publishers, or stages that wait for each other.
    pub fn together(plans: Vec<NodePlan>, timing: &Timing, transport: Box<dyn Transport>, options: Options) -> Result<Runner, RunError> {
        let names: Vec<&str> = plans.iter().map(|p| p.name.as_str()).collect();
        let refuse = |node: &str, reason: String| RunError::Plan { node: node.to_string(), reason };
        if let Some(empty) = plans.iter().find(|p| p.stages.is_empty()) {
            return Err(refuse(&empty.name, "it has no stage".into()));
        }
        if plans.is_empty() || !(timing.rate_hz.is_finite() && timing.rate_hz > 0.0) {
            return Err(refuse(&names.join("+"), format!("a rate of {} Hz is not possible", timing.rate_hz)));
        }
        let order: Vec<(usize, usize)> = match plans.as_slice() {
            [alone] => (0..alone.stages.len()).map(|stage| (0, stage)).collect(),
            _ => stage_order(&plans).map_err(|e| refuse(&names.join("+"), e.to_string()))?,
        };
        let mut transport = Together::around(transport);
        let expected = |topic: &Topic| options.listeners.get(&topic.name).copied().unwrap_or(0);
        let mut output = |topic: &Topic, axes: usize| -> Result<Output, TransportError> {
            Ok(Output { publisher: transport.publisher(topic, expected(topic))?, topic: topic.clone(), axes, sequence: 0 })
        };
        let (mut waiting, mut members) = (Vec::new(), Vec::new());
        let mut gains_topics = Vec::new();
        for (member, plan) in plans.into_iter().enumerate() {
            for (index, stage) in plan.stages.into_iter().enumerate() {
                let outputs = stage.outputs.iter().map(|o| output(&o.topic, o.axes)).collect::<Result<Vec<_>, _>>()?;
                let place = order.iter().position(|o| *o == (member, index)).unwrap_or(usize::MAX);
                waiting.push((place, member, index == 0, stage, outputs));
            }
            let (events, status) = (output(&plan.events, 0)?, output(&plan.status, 0)?);
            let gains_out = plan.gains_out.as_ref().map(|t| output(t, 0)).transpose()?;
            let margin_out = plan.margin_out.as_ref().map(|t| output(t, 0)).transpose()?;
            let lists = plan.lists.iter().map(|(t, numbers)| output(t, *numbers)).collect::<Result<Vec<_>, _>>()?;
            let book = Book::new(&plan.name, timing);
            gains_topics.push(plan.gains_in);
            members.push(Member {
                name: plan.name,
                teller: Teller { book, events, status, noted: Events::default(), report: NodeStatus::default(), broken_told_at: i64::MIN },
                gains_in: None,
                gains_out,
                margin_out,
                lists,
                lists_due: 0,
                loop_time: Histogram::default(),
                loop_time_recent: Histogram::default(),
                skipped: 0,
                late_told: (0, 0),
            });
        }
        waiting.sort_by_key(|(place, ..)| *place);
        // All outputs exist by now, so that an input can find whether its topic has a publisher here.
        let stages = waiting
            .into_iter()
            .map(|(_, member, is_first, stage, outputs)| {
                let mut inputs = Vec::new();
                for port in &stage.inputs {
                    let subscriber = transport.subscriber(&port.topic, usize::MAX, true)?;
                    inputs.push(Input::new(port, timing.rate_hz, port.name == PACE_PORT, subscriber));
                }
                Ok(Stage {
                    member,
                    is_first,
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
        for (member, topic) in members.iter_mut().zip(&gains_topics) {
            member.gains_in = topic.as_ref().map(|t| transport.subscriber(t, 64, false)).transpose()?;
        }
        Ok(Runner { timing: timing.clone(), options, members, stages, reported_at: 0, transport: Box::new(transport) })
    }

    /// The name of the node, or of the first where there are several.
    pub fn name(&self) -> &str {
        self.members.first().map_or("", |m| m.name.as_str())
    }

    /// Refuses to begin where somebody else sends on one of its topics.
    ///
    /// # Errors
    /// Somebody does.
    pub fn check_alone(&mut self) -> Result<(), RunError> {
        let gains = self.members.iter_mut().filter_map(|m| m.gains_in.as_mut()).find_map(|gains| gains.stranger());
        let stranger = gains.or_else(|| self.stages.iter_mut().flat_map(|s| &mut s.inputs).find_map(Input::stranger));
        stranger.map_or(Ok(()), |e| Err(RunError::Taken(e)))
    }

    /// Opens what a node needs of the world, before its first step. What a person should know becomes events.
    ///
    /// # Errors
    /// A device cannot be opened, or fails a check.
    pub fn begin(&mut self, tell: &mut dyn FnMut(Told)) -> Result<(), RunError> {
        for stage in &mut self.stages {
            let member = &mut self.members[stage.member];
            let notes = stage.core.begin().map_err(|reason| RunError::Device { node: member.name.clone(), reason })?;
            for note in notes {
                member.teller.tell_event(0, 0, "device_note", NO_VALUE, 1, Text::new(&note), tell);
            }
        }
        Ok(())
    }

    /// What it still lacks before it can start, one line each.
    pub fn missing(&self) -> Vec<String> {
        let inputs = self.stages.iter().flat_map(|s| &s.inputs);
        let mut lines: Vec<String> = inputs.filter(|i| !i.has_publisher()).map(|i| format!("{}: no publisher", i.topic)).collect();
        let outputs = self.stages.iter().flat_map(|s| &s.outputs).chain(self.members.iter().flat_map(Member::side_outputs));
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
        for member in &mut self.members {
            member.teller.tell_event(0, 0, kind, NO_VALUE, severity, Text::new(text), tell);
        }
    }
}
