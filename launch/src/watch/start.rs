//! From the first process to step 0.

use super::state::{Start, Supervisor};
use super::times::nanoseconds;
use crate::child::{Child, Spawn};
use crate::error::LaunchError;
use crate::hosts::{Begun, There};
use crate::report::Cause;
use crate::screen::Display;
use crate::slot::{Phase, Slot};
use backdrive_nodes::protocol::ToNode;
use nix::sys::signal::Signal;
use nix::time::ClockId;
use std::time::{Duration, Instant};

/// Time between the word to start and step 0: every node has heard it by then.
const START_LEAD: [Duration; 2] = [Duration::from_millis(50), Duration::from_millis(200)];

impl Supervisor {
    pub(crate) fn spawn(&mut self, index: usize) -> Result<(), LaunchError> {
        let root = self.directory.paths().root().to_string_lossy().into_owned();
        let slot = &mut self.slots[index];
        let mut argv = slot.plan.command.clone().unwrap_or_else(|| {
            let mut ours = self.options.node_command.clone();
            ours.push("node".to_string());
            ours
        });
        argv.extend(["--run".to_string(), root, "--name".to_string(), slot.plan.name.clone()]);
        slot.life += 1;
        // A recorder may finish its file: it does so at the end of its standard input. Our own nodes set a signal that only wakes them, and end by
        // themselves within seconds. Whoever hangs is left to the next sweep.
        let orphaned = if slot.plan.records { Signal::SIGTERM } else { Signal::SIGKILL };
        let label = slot.plan.label();
        let spawn = Spawn { name: &label, node: index, life: slot.life, argv: &argv, orphaned };
        let child = Child::spawn(&spawn, self.notices.clone())?;
        self.directory.note(child.pid(), &slot.plan.label());
        slot.begin(child, Instant::now());
        Ok(())
    }

    pub(crate) fn ready(&mut self, index: usize, now: Instant) {
        let slot = &mut self.slots[index];
        slot.created = true;
        slot.missing.clear();
        if slot.phase != Phase::Joining {
            return;
        }
        if let Some(start) = self.start {
            // It was started again, and joins at the step that is due.
            slot.enter(Phase::Running, now);
            slot.tell(&ToNode::Start { t0_ns: start.t0_ns, unix_ns: start.unix_ns });
            let name = slot.plan.label();
            self.pass_gains(index);
            if let Some(death) = self.deaths.iter_mut().rev().find(|d| d.node == name) {
                death.recovered = true;
            }
            self.tell(0, "node_restarted", format!("`{name}` is back"));
            return;
        }
        slot.enter(Phase::Ready, now);
        if self.stopping || self.slots.iter().any(|s| s.phase != Phase::Ready) {
            return;
        }
        if let Some(hosts) = &self.hosts {
            // They settle together when to start.
            return hosts.tell(|here| here.ready = true);
        }
        let lead_ns = START_LEAD[usize::from(self.plan.realtime())].as_nanos() as i64;
        self.begin(Begun {
            t0_ns: nanoseconds(ClockId::CLOCK_MONOTONIC) + lead_ns,
            unix_ns: nanoseconds(ClockId::CLOCK_REALTIME) + lead_ns,
        });
    }

    /// Step 0 is due then; in the past for a host that joins a run.
    pub(crate) fn begin(&mut self, begun: Begun) {
        if self.start.is_some() || self.stopping {
            return;
        }
        let now = Instant::now();
        let lead_ns = begun.t0_ns - nanoseconds(ClockId::CLOCK_MONOTONIC);
        let lead = Duration::from_nanos(lead_ns.unsigned_abs());
        let at = if lead_ns >= 0 { now + lead } else { now.checked_sub(lead).unwrap_or(now) };
        let start = Start { at, t0_ns: begun.t0_ns, unix_ns: begun.unix_ns };
        self.start = Some(start);
        self.connected = Some(now);
        for slot in &mut self.slots {
            slot.tell(&ToNode::Start { t0_ns: start.t0_ns, unix_ns: start.unix_ns });
            slot.enter(Phase::Running, now);
            slot.progress = now;
        }
        for index in 0..self.slots.len() {
            self.pass_gains(index);
        }
    }

    /// The messages of the other hosts, and those of this one to them.
    pub(crate) fn meet(&mut self) {
        let Some(hosts) = &self.hosts else { return };
        let lacks: Vec<String> = self.slots.iter().filter(|s| s.phase == Phase::Joining).map(Slot::lack).collect();
        let begun = self.start.map(|s| Begun { t0_ns: s.t0_ns, unix_ns: s.unix_ns });
        let leaving = self.stopping || self.finished.is_some();
        hosts.tell(|here| {
            here.missing = lacks;
            here.begun = begun;
            here.leaving |= leaving;
        });
        for there in hosts.hear() {
            match there {
                There::Start(begun) => self.begin(begun),
                There::Missing(absent) => {
                    if absent != self.absent && self.options.display != Display::Quiet {
                        absent.iter().for_each(|line| self.screen.line(format!("waiting: {line}")));
                    }
                    self.absent = absent;
                }
                There::Event(severity, kind, text) => self.tell(severity, kind, text),
                // In lockstep no step can be done without it; what is done already is no loss.
                There::Left(host) if !self.plan.realtime() && self.finishing.is_none() && self.start.is_none() => {
                    self.stop(Cause::Stopped { by: format!("host {host}") });
                }
                There::Left(_) => {}
            }
        }
    }

    pub(crate) fn pass_gains(&self, index: usize) {
        let slot = &self.slots[index];
        if let (true, Phase::Running, Some(gains)) = (slot.plan.has_gains, slot.phase, &self.gains) {
            slot.tell(gains);
        }
    }
}
