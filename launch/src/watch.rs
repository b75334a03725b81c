//! What happens between the start of a run and its end.

use crate::child::{Child, End, Heard, Notice, Spawn};
use crate::error::LaunchError;
use crate::hosts::{Begun, Hosts, There};
use crate::plan::Plan;
use crate::report::{Cause, Death, RunEvent, RunReport};
use crate::rundir::RunDir;
use crate::screen::{Display, Screen};
use crate::signals::Signals;
use crate::slot::{Asked, Phase, Slot};
use crate::supervise::{Command, OnDeath, SuperviseOptions};
use backdrive_nodes::protocol::{FromNode, ToNode};
use nix::sys::signal::Signal;
use nix::time::{ClockId, clock_gettime};
use std::collections::VecDeque;
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

/// How often timers and signals are looked at.
const TICK: Duration = Duration::from_millis(50);

/// Time between the word to start and step 0: every node has heard it by then.
const START_LEAD: [Duration; 2] = [Duration::from_millis(50), Duration::from_millis(200)];

/// First pause before a node is started again; it doubles each time.
const BACKOFF: Duration = Duration::from_millis(100);

/// Longest pause before a node is started again.
const LONGEST_BACKOFF: Duration = Duration::from_secs(2);

/// In real time a node that is not heard for this long is reported.
const SILENCE: Duration = Duration::from_secs(3);

/// How long a recorder may take to see by itself that the planned steps are over.
const RECORDER_LEAD: Duration = Duration::from_secs(1);

/// How long a killed process may take to be gone before it is given up.
const UNKILLABLE: Duration = Duration::from_secs(10);

/// Events that are kept.
pub(crate) const MOST_EVENTS: usize = 10_000;

/// Step 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Start {
    pub at: Instant,
    t0_ns: i64,
    unix_ns: i64,
}

pub(crate) struct Supervisor {
    pub plan: Plan,
    pub options: SuperviseOptions,
    pub directory: RunDir,
    pub screen: Screen,
    pub slots: Vec<Slot>,
    pub begun: Instant,
    pub connected: Option<Instant>,
    pub start: Option<Start>,
    /// When the last node but the recorder had ended.
    pub finished: Option<Instant>,
    /// Since when the first node is done.
    finishing: Option<Instant>,
    pub stopping: bool,
    killing: bool,
    /// Why it was stopped.
    pub cause: Option<Cause>,
    /// The first node that is lost for good.
    pub loss: Option<Cause>,
    error: Option<LaunchError>,
    gains: Option<ToNode>,
    pub events: Vec<RunEvent>,
    pub events_left_out: u64,
    pub deaths: Vec<Death>,
    pub killed: Vec<String>,
    unkillable: bool,
    /// (when, steps) of the last seconds.
    pub pace: VecDeque<(Instant, u64)>,
    /// The other hosts of the run, if it has some, and who of them is missing.
    hosts: Option<Hosts>,
    absent: Vec<String>,
    notices: mpsc::Sender<Notice>,
    heard: Option<mpsc::Receiver<Notice>>,
}

impl Supervisor {
    pub fn new(plan: Plan, options: SuperviseOptions, directory: RunDir, screen: Screen) -> Supervisor {
        let now = Instant::now();
        let slots = plan.nodes.iter().map(|n| Slot::new(n.clone(), now)).collect();
        let (notices, heard) = mpsc::channel(1024);
        Supervisor {
            plan,
            options,
            directory,
            screen,
            slots,
            begun: now,
            connected: None,
            start: None,
            finished: None,
            finishing: None,
            stopping: false,
            killing: false,
            cause: None,
            loss: None,
            error: None,
            gains: None,
            events: Vec::new(),
            events_left_out: 0,
            deaths: Vec::new(),
            killed: Vec::new(),
            unkillable: false,
            pace: VecDeque::new(),
            hosts: None,
            absent: Vec::new(),
            notices,
            heard: Some(heard),
        }
    }

    /// The whole life of the run. Afterwards nothing of it is left.
    pub async fn run(mut self, mut signals: Signals, commands: Option<mpsc::Receiver<Command>>) -> Result<RunReport, LaunchError> {
        match Hosts::begin(&self.plan) {
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
        self.watch(&mut signals, commands).await;
        // Nobody is heard any more: a process with much to say must not wait for its listener.
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

    async fn watch(&mut self, signals: &mut Signals, mut commands: Option<mpsc::Receiver<Command>>) {
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
            }
        }
    }

    fn spawn(&mut self, index: usize) -> Result<(), LaunchError> {
        let root = self.directory.paths().root().to_string_lossy().into_owned();
        let slot = &mut self.slots[index];
        let mut argv = slot.plan.command.clone().unwrap_or_else(|| {
            let mut ours = self.options.node_command.clone();
            ours.push("node".to_string());
            ours
        });
        argv.extend(["--run".to_string(), root, "--name".to_string(), slot.plan.name.clone()]);
        slot.life += 1;
        // A recorder may finish its file: the end of its standard input tells it to. Our own nodes set a signal
        // that only wakes them, and end by themselves within seconds. Whoever hangs is left to the next sweep.
        let orphaned = if slot.plan.records { Signal::SIGTERM } else { Signal::SIGKILL };
        let spawn = Spawn { name: &slot.plan.name, node: index, life: slot.life, argv: &argv, orphaned };
        let child = Child::spawn(&spawn, self.notices.clone())?;
        self.directory.note(child.pid(), &slot.plan.name);
        slot.begin(child, Instant::now());
        Ok(())
    }

    fn hear(&mut self, notice: Notice) {
        let now = Instant::now();
        let index = notice.node;
        if self.slots[index].life != notice.life {
            return;
        }
        self.slots[index].heard = now;
        if std::mem::take(&mut self.slots[index].silent) {
            self.tell(0, "node_back", format!("`{}` is heard again", self.slots[index].plan.name));
        }
        match notice.heard {
            Heard::Said(FromNode::Created) => self.slots[index].created = true,
            Heard::Said(FromNode::Waiting { missing }) => {
                self.slots[index].created = true;
                self.slots[index].missing = missing;
            }
            Heard::Said(FromNode::Ready) => self.ready(index, now),
            Heard::Said(FromNode::Status(status)) => {
                self.slots[index].take_status(status, now);
                self.keep_pace(index, now);
            }
            Heard::Said(FromNode::Event { step, severity, kind, text, value }) => {
                let node = self.slots[index].plan.name.clone();
                let t_s = self.start.map(|s| seconds_since(now, s.at));
                self.event(Some(index), RunEvent { node, t_s, step: Some(step), severity, kind, text, value });
            }
            Heard::Said(FromNode::Done(status)) => {
                self.slots[index].take_status(status, now);
                self.slots[index].done = true;
                self.keep_pace(index, now);
            }
            Heard::Said(FromNode::Failed { error, code }) => self.slots[index].failed = Some((error, code)),
            Heard::Stray(line) => {
                if !std::mem::replace(&mut self.slots[index].stray, true) {
                    let name = &self.slots[index].plan.name;
                    let text = format!("`{name}` writes lines on standard output that are not of the protocol; they are shown here");
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

    fn ready(&mut self, index: usize, now: Instant) {
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
            let name = slot.plan.name.clone();
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
    fn begin(&mut self, begun: Begun) {
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

    /// What the other hosts say, and what this one says to them.
    fn meet(&mut self) {
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

    fn pass_gains(&self, index: usize) {
        let slot = &self.slots[index];
        if let (true, Phase::Running, Some(gains)) = (slot.plan.has_gains, slot.phase, &self.gains) {
            slot.tell(gains);
        }
    }

    fn obey(&mut self, command: Command) {
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

    fn signalled(&mut self, signal: Signal) {
        match signal {
            Signal::SIGTSTP => self.screen.line("a run cannot be suspended: its loop would go on unwatched; Ctrl-C stops it".to_string()),
            Signal::SIGINT if self.stopping => {
                self.screen.line("killing what is left".to_string());
                self.kill();
            }
            _ => {
                if self.options.display != Display::Quiet {
                    self.screen.line("stopping in order; another Ctrl-C kills".to_string());
                }
                let by = signal.as_str().to_string();
                if self.start.is_none() && self.error.is_none() {
                    self.error = Some(LaunchError::Stopped { by: by.clone() });
                }
                self.stop(Cause::Stopped { by });
            }
        }
    }

    /// Ends the run in order: the recorder goes last, so that it hears the others to the end.
    fn stop(&mut self, cause: Cause) {
        if self.stopping {
            return;
        }
        let now = Instant::now();
        self.stopping = true;
        self.cause.get_or_insert(cause);
        for slot in &mut self.slots {
            if matches!(slot.phase, Phase::Backoff { .. }) {
                slot.enter(Phase::Ended, now);
            } else if !slot.plan.records || self.start.is_none() {
                slot.ask(Asked::Stop, now);
            }
        }
    }

    /// Ends a run that cannot start.
    fn give_up(&mut self, error: LaunchError) {
        self.error.get_or_insert(error);
        self.stop(Cause::Completed);
    }

    fn kill(&mut self) {
        self.killing = true;
        let now = Instant::now();
        for slot in &mut self.slots {
            match slot.child {
                Some(_) => slot.ask(Asked::Kill, now),
                None => slot.enter(Phase::Ended, now),
            }
        }
    }

    fn ended(&mut self, index: usize, end: End, now: Instant) {
        let started = self.start.is_some();
        let slot = &mut self.slots[index];
        slot.child = None;
        let name = slot.plan.name.clone();
        let asked = slot.asked;
        if slot.done && end.signal.is_none() || asked >= Asked::Stop && slot.failed.is_none() && end.code == Some(0) {
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
            slot.end = slot.failed.as_ref().map_or_else(|| end.words(), |(error, _)| error.clone());
            let stderr = slot.stderr.iter().cloned().collect();
            let error = match slot.failed.clone() {
                Some((error, code)) => LaunchError::NodeFailed { node: name, error, code },
                None => LaunchError::DiedAtStart { node: name, how: end.words(), stderr },
            };
            if !self.stopping {
                self.give_up(error);
            }
        } else if self.stopping && !slot.plan.records && end.signal.is_none() {
            // One that has lost its peers because the run ends is no death of its own.
            slot.end = slot.failed.as_ref().map_or_else(|| end.words(), |(error, _)| error.clone());
            slot.enter(Phase::Ended, now);
        } else {
            self.died(index, end, now);
        }
    }

    fn died(&mut self, index: usize, end: End, now: Instant) {
        let realtime = self.plan.realtime();
        let t_s = self.start.map_or(0.0, |s| seconds_since(now, s.at));
        let slot = &mut self.slots[index];
        let name = slot.plan.name.clone();
        let how = slot.failed.as_ref().map_or_else(|| end.words(), |(error, _)| format!("failed: {error}"));
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
        let (name, steps) = (slot.plan.name.clone(), slot.steps());
        if !self.plan.realtime() && self.plan.timing.steps.is_none_or(|planned| steps < planned) {
            self.tell(1, "ended_early", format!("`{name}` has ended by itself after {steps} steps, and the others with it"));
            self.cause.get_or_insert(Cause::EndedEarly { node: name, steps });
        }
        if !self.plan.realtime() || self.plan.timing.steps.is_some_and(|planned| steps >= planned) {
            self.finishing.get_or_insert(now);
        }
    }

    /// Whatever is due.
    fn act(&mut self, now: Instant) {
        self.meet();
        if self.start.is_none() && !self.stopping && now.saturating_duration_since(self.begun) > self.options.ready_timeout {
            let mut missing: Vec<String> = self.slots.iter().filter(|s| s.phase == Phase::Joining).map(Slot::lack).collect();
            missing.append(&mut self.absent);
            self.give_up(LaunchError::NotReady { after_s: self.options.ready_timeout.as_secs_f64(), missing });
        }
        for index in 0..self.slots.len() {
            self.act_on(index, now);
        }
        if self.start.is_some() && self.slots.iter().all(|s| s.plan.records || s.ended()) {
            let finished = *self.finished.get_or_insert(now);
            let by_itself = self.finishing.is_some() && !self.stopping && now.saturating_duration_since(finished) < RECORDER_LEAD;
            if !by_itself {
                for slot in self.slots.iter_mut().filter(|s| s.asked == Asked::No) {
                    slot.ask(Asked::Stop, now);
                }
            }
        }
    }

    fn act_on(&mut self, index: usize, now: Instant) {
        let started = self.start.is_some();
        let slot = &mut self.slots[index];
        let (grace, since) = match slot.plan.records {
            true => (self.options.recorder_grace, slot.asked_at.max(slot.progress)),
            false => (self.options.grace, slot.asked_at),
        };
        let over = now.saturating_duration_since(since) > grace;
        match (slot.phase, slot.asked) {
            (Phase::Ended, _) => {}
            (Phase::Backoff { until }, _) if now >= until => {
                if let Err(e) = self.spawn(index) {
                    let slot = &mut self.slots[index];
                    slot.failed = Some((e.to_string(), 1));
                    slot.restarts = self.options.max_restarts;
                    self.died(index, End { code: None, signal: None }, now);
                }
            }
            (Phase::Backoff { .. }, _) => {}
            (_, Asked::Stop) if over => slot.ask(Asked::Term, now),
            (_, Asked::Term) if over => slot.ask(Asked::Kill, now),
            (_, Asked::Kill) if now.saturating_duration_since(slot.asked_at) > UNKILLABLE => {
                slot.end = "does not die".to_string();
                slot.enter(Phase::Ended, now);
                self.unkillable = true;
                self.killed.push(slot.plan.name.clone());
                let text = format!("`{}` does not die; what the run leaves is removed at the next start", slot.plan.name);
                self.tell(2, "node_unkillable", text);
            }
            (Phase::Joining, Asked::No) if started && now.saturating_duration_since(slot.since) > self.options.ready_timeout => {
                slot.failed = Some((format!("was not ready in time after it was started again: {}", slot.lack()), 1));
                slot.ask(Asked::Kill, now);
            }
            (Phase::Running, Asked::No) => {
                // Only on the way to the planned end do further steps buy further time.
                let on_the_way = self.cause.is_none() && self.plan.timing.steps.is_some_and(|planned| slot.steps() < planned);
                let progress = if on_the_way { slot.progress } else { self.begun };
                let late = self.finishing.is_some_and(|f| now.saturating_duration_since(f.max(progress)) > self.options.grace);
                if late && !slot.plan.records {
                    slot.ask(Asked::Stop, now);
                    let text = format!("`{}` has not ended with the others; it is stopped", slot.plan.name);
                    self.tell(1, "node_late", text);
                } else if self.plan.realtime() && !slot.silent && now.saturating_duration_since(slot.heard) > SILENCE {
                    slot.silent = true;
                    let text = format!("`{}` has not been heard for {} s; it may hang", slot.plan.name, SILENCE.as_secs());
                    self.tell(1, "node_silent", text);
                }
            }
            _ => {}
        }
    }
}

fn nanoseconds(clock: ClockId) -> i64 {
    clock_gettime(clock).map_or(Duration::ZERO, Duration::from).as_nanos() as i64
}

/// Negative if `at` is in the future.
pub(crate) fn seconds_since(now: Instant, at: Instant) -> f64 {
    now.saturating_duration_since(at).as_secs_f64() - at.saturating_duration_since(now).as_secs_f64()
}
