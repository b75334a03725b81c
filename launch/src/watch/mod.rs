//! What happens between the start of a run and its end.

mod answers;
mod deaths;
mod standing;
mod start;
mod state;
mod stop;
mod timers;
mod times;

pub(crate) use state::{MOST_EVENTS, Supervisor};
pub(crate) use times::seconds_since;

use crate::asks::Asked;
use crate::child::{Heard, Notice};
use crate::error::LaunchError;
use crate::hosts::Hosts;
use crate::options::Command;
use crate::report::{Cause, RunEvent, RunReport};
use crate::signals::Signals;
use crate::slot::{Phase, Slot};
use backdrive_nodes::protocol::{FromNode, STRANGER, ToNode};
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

/// How often timers and signals are looked at.
const TICK: Duration = Duration::from_millis(50);

impl Supervisor {
    /// The whole life of the run. Afterwards nothing of it is left.
    pub async fn run(
        mut self,
        mut signals: Signals,
        commands: Option<mpsc::Receiver<Command>>,
        asks: Option<mpsc::Receiver<Asked>>,
    ) -> Result<RunReport, LaunchError> {
        match Hosts::begin(&self.plan, &self.session) {
            Ok(hosts) => self.hosts = hosts,
            Err(e) => {
                self.slots.iter_mut().for_each(|s| s.enter(Phase::Ended, Instant::now()));
                self.give_up(e);
            }
        }
        for index in 0..self.slots.len() {
            if self.error.is_some() {
                break;
            }
            if let Err(e) = self.spawn(index) {
                self.slots[index].enter(Phase::Ended, Instant::now());
                self.give_up(e);
                self.kill();
                break;
            }
        }
        self.watch(&mut signals, commands, asks).await;
        // Output is ignored from now on: a process with much output must not wait for its listener.
        self.heard = None;
        if !self.unkillable {
            for slot in &mut self.slots {
                if let Some(child) = slot.child.take() {
                    child.end().await;
                }
            }
        }
        let report = self.report();
        let (screen, directory) = (self.screen, self.directory);
        if self.unkillable {
            // A process of it lives: the next sweep tries again.
            drop(directory);
        } else if let Err(e) = directory.remove() {
            screen.line(format!("warning: {e}"));
        }
        self.error.map_or(Ok(report), Err)
    }

    async fn watch(
        &mut self,
        signals: &mut Signals,
        mut commands: Option<mpsc::Receiver<Command>>,
        mut asks: Option<mpsc::Receiver<Asked>>,
    ) {
        let Some(mut heard) = self.heard.take() else { return };
        let mut tick = tokio::time::interval(TICK);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        while !self.slots.iter().all(Slot::ended) {
            let command = async {
                match &mut commands {
                    Some(commands) => commands.recv().await,
                    None => std::future::pending().await,
                }
            };
            let ask = async {
                match &mut asks {
                    Some(asks) => asks.recv().await,
                    None => std::future::pending().await,
                }
            };
            tokio::select! {
                Some(notice) = heard.recv() => self.hear(notice),
                _ = tick.tick() => {
                    while let Some(signal) = signals.next() {
                        self.signalled(signal);
                    }
                    self.act(Instant::now());
                    self.show(Instant::now());
                }
                command = command => match command {
                    Some(command) => self.obey(command),
                    None => commands = None,
                },
                ask = ask => match ask {
                    Some(asked) => self.answer(asked),
                    None => asks = None,
                },
            }
        }
    }

    fn hear(&mut self, notice: Notice) {
        let now = Instant::now();
        let index = notice.node;
        if self.slots[index].life != notice.life {
            return;
        }
        self.slots[index].heard = now;
        if std::mem::take(&mut self.slots[index].silent) {
            self.tell(0, "node_back", format!("`{}` responds again", self.slots[index].plan.label()));
        }
        match notice.heard {
            Heard::Said(FromNode::Created) => self.slots[index].created = true,
            Heard::Said(FromNode::Waiting { missing }) => {
                self.slots[index].created = true;
                self.slots[index].missing = missing;
            }
            Heard::Said(FromNode::Ready) => self.ready(index, now),
            Heard::Said(FromNode::Of { node, said }) => self.hear_of(index, node, *said, now),
            Heard::Said(FromNode::Status(status)) => {
                self.slots[index].take_status(None, status, now);
                self.keep_pace(index, now);
            }
            Heard::Said(FromNode::Event { step, severity, kind, text, value }) => {
                let node = self.slots[index].plan.name.clone();
                self.happened(index, now, RunEvent { node, t_s: None, step: Some(step), severity, kind, text, value });
            }
            Heard::Said(FromNode::Done(status)) => {
                self.slots[index].take_status(None, status, now);
                self.slots[index].done = true;
                self.keep_pace(index, now);
            }
            Heard::Said(FromNode::Failed { error, code }) => self.slots[index].failed = Some((error, code)),
            Heard::Stray(line) => {
                if !std::mem::replace(&mut self.slots[index].stray, true) {
                    let name = self.slots[index].plan.label();
                    let text = format!("`{name}` writes lines to standard output that are not part of the protocol; they are shown here");
                    self.tell(1, "stray_output", text);
                }
                self.pass_on(index, &line, now);
            }
            Heard::Wrote(line) => {
                self.pass_on(index, &line, now);
                self.slots[index].wrote(line);
            }
            Heard::Ended(end) => self.ended(index, end, now),
        }
    }

    /// A message about a node that shares the process of the first.
    fn hear_of(&mut self, index: usize, node: String, said: FromNode, now: Instant) {
        match said {
            FromNode::Status(status) => self.slots[index].take_status(Some(&node), status, now),
            FromNode::Event { step, severity, kind, text, value } => {
                self.happened(index, now, RunEvent { node, t_s: None, step: Some(step), severity, kind, text, value });
            }
            // Everything else concerns the process.
            _ => {}
        }
    }

    /// An event that a node reports. Where a stranger sends what moves something, the run ends; nothing of it was taken.
    fn happened(&mut self, index: usize, now: Instant, event: RunEvent) {
        let stranger = (event.kind == STRANGER && event.severity >= 2).then(|| (event.node.clone(), event.text.clone()));
        self.event(Some(index), RunEvent { t_s: self.start.map(|s| seconds_since(now, s.at)), ..event });
        if let Some((node, text)) = stranger {
            self.stop(Cause::Stranger { node, text });
        }
    }

    pub(crate) fn obey(&mut self, command: Command) {
        match command {
            Command::Stop => self.stop(Cause::Stopped { by: "command".to_string() }),
            Command::Gains { mu, lambda, ramp_s } => {
                if !(mu.is_finite() && lambda.is_finite() && ramp_s.is_finite() && ramp_s >= 0.0) {
                    let text = format!(
                        "gains mu = {mu}, lambda = {lambda} over {ramp_s} s are refused: they must be finite, the ramp not negative"
                    );
                    return self.tell(1, "gains_refused", text);
                }
                self.gains = Some(ToNode::Gains { mu, lambda, ramp_s });
                for index in 0..self.slots.len() {
                    self.pass_gains(index);
                }
            }
        }
    }
}
