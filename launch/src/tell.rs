//! What the supervisor shows a person during the run, and the report after it.

use crate::member::Member;
use crate::plan::Named;
use crate::report::{Cause, NodeReport, RunEvent, RunReport};
use crate::screen::Display;
use crate::slot::{Phase, Slot};
use crate::status::Summary;
use crate::watch::{MOST_EVENTS, Supervisor, seconds_since};
use backdrive_nodes::protocol::NodeStatus;
use std::time::{Duration, Instant};

/// How long the pace is averaged.
const WINDOW: Duration = Duration::from_secs(1);

/// How long a start may take before the cause of the wait is shown.
const PATIENCE: Duration = Duration::from_secs(1);

impl Supervisor {
    /// An event of the supervisor's own.
    pub fn tell(&mut self, severity: u32, kind: &str, text: String) {
        let t_s = self.start.map(|s| seconds_since(Instant::now(), s.at));
        let event = RunEvent { node: "supervisor".to_string(), t_s, step: None, severity, kind: kind.to_string(), text, value: None };
        self.event(None, event);
    }

    /// Keeps an event and shows it, unless its node reports too many.
    pub fn event(&mut self, from: Option<usize>, event: RunEvent) {
        let now = Instant::now();
        // While the run is stopped, nodes report that others are gone; that is kept, but no news.
        let aftermath = self.stopping && from.is_some() && event.severity < 2;
        let wanted = !aftermath && (event.severity > 0 || self.options.display != Display::Quiet);
        if wanted {
            match from.map(|index| self.slots[index].events.pass(now)) {
                None => self.screen.line(event.to_string()),
                Some(None) => {}
                Some(Some(held)) => {
                    if held > 0 {
                        self.screen.line(format!("{}: ({held} events not shown)", event.node));
                    }
                    self.screen.line(event.to_string());
                }
            }
        }
        if self.events.len() < MOST_EVENTS {
            self.events.push(event);
        } else {
            self.events_left_out += 1;
        }
    }

    /// Shows what a node wrote by itself.
    pub fn pass_on(&mut self, index: usize, line: &str, now: Instant) {
        let slot = &mut self.slots[index];
        let Some(held) = slot.lines.pass(now) else { return };
        let label = slot.plan.label();
        if held > 0 {
            self.screen.line(format!("{label} | ({held} lines not shown)"));
        }
        self.screen.line(format!("{label} | {line}"));
    }

    pub fn keep_pace(&mut self, index: usize, now: Instant) {
        let steps = self.slots[index].steps();
        if self.slots[index].plan.records || self.pace.back().is_some_and(|(_, last)| steps <= *last) {
            return;
        }
        self.pace.push_back((now, steps));
        // One that is older than the window stays, so that the window is always covered.
        while self.pace.len() > 2 && self.pace.get(1).is_some_and(|(at, _)| now.saturating_duration_since(*at) > WINDOW) {
            self.pace.pop_front();
        }
    }

    /// Shows how the run does.
    pub fn show(&mut self, now: Instant) {
        for index in 0..self.slots.len() {
            let slot = &mut self.slots[index];
            let name = slot.plan.label();
            if let Some(held) = slot.lines.settle(now) {
                self.screen.line(format!("{name} | ({held} lines not shown)"));
            }
            if let Some(held) = slot.events.settle(now) {
                self.screen.line(format!("{name}: ({held} events not shown)"));
            }
        }
        if self.options.display != Display::Quiet {
            self.screen.summary(self.summary(now));
        }
    }

    fn doing(&self, now: Instant) -> String {
        let names = |with: fn(&Slot) -> bool| -> Vec<String> { self.slots.iter().filter(|s| with(s)).map(|s| s.plan.label()).collect() };
        if self.stopping {
            return format!("stopping, waiting for {}", names(|s| !s.ended()).join(", "));
        }
        if self.start.is_none() {
            let lacking: Vec<String> = self.slots.iter().filter(|s| s.phase == Phase::Joining).map(Slot::lack).collect();
            return match now.saturating_duration_since(self.begun) > PATIENCE {
                true => format!("waiting for {}", lacking.join("; ")),
                false => format!("starting {} processes", self.slots.len()),
            };
        }
        if self.finished.is_some() {
            return format!("finishing, waiting for {}", names(|s| !s.ended()).join(", "));
        }
        String::new()
    }

    fn summary(&self, now: Instant) -> Summary {
        let steps_per_s = match (self.pace.front(), self.pace.back()) {
            (Some((from, first)), Some((to, last))) if to.saturating_duration_since(*from) > WINDOW / 4 => {
                Some((last - first) as f64 / to.saturating_duration_since(*from).as_secs_f64())
            }
            _ => None,
        };
        let (_, loop_p50_us, loop_p99_us) = self.loop_times();
        let lost = |s: &Slot| !matches!(s.end.as_str(), "" | "done" | "stopped") || matches!(s.phase, Phase::Backoff { .. });
        Summary {
            doing: self.doing(now),
            elapsed: self.start.map_or(Duration::ZERO, |s| now.saturating_duration_since(s.at)),
            steps: self.steps(),
            planned: self.plan.timing.steps,
            rate_hz: self.plan.timing.rate_hz,
            realtime: self.plan.realtime(),
            steps_per_s,
            loop_p50_us,
            loop_p99_us,
            lost: self.statuses().map(|s| s.lost).sum(),
            refused: self.statuses().map(|s| s.refused).sum(),
            missed_deadlines: self.statuses().map(|s| s.missed_deadlines).sum(),
            peak_effort: self.slots.iter().filter(|s| !s.plan.records).filter_map(|s| s.recent_peak(now)).reduce(f64::max),
            margin: self.statuses().find_map(|s| s.margin).map(|m| m.to_string()),
            bag_bytes: self.statuses().find_map(|s| s.recorded).map(|(_, bytes)| bytes),
            dead: self.slots.iter().filter(|s| lost(s)).map(|s| s.plan.label()).collect(),
        }
    }

    fn steps(&self) -> u64 {
        self.slots.iter().filter(|s| !s.plan.records).map(Slot::steps).max().unwrap_or(0)
    }

    /// Of every node that has reported its state.
    fn statuses(&self) -> impl Iterator<Item = &NodeStatus> {
        self.slots.iter().flat_map(|s| &s.members).filter_map(|m| m.status.as_ref())
    }

    /// Nodes other than the recorder that have reported their state.
    fn running(&self) -> impl Iterator<Item = (&Named, &NodeStatus)> {
        self.slots.iter().filter(|s| !s.plan.records).flat_map(|s| &s.members).filter_map(|m| Some((&m.node, m.status.as_ref()?)))
    }

    /// The master's loop times, or without a master those of the slowest node.
    fn loop_times(&self) -> (Option<String>, Option<f64>, Option<f64>) {
        let timed = || self.running().filter(|(_, t)| t.steps > 0 && t.loop_p50_us > 0.0);
        let slowest = || timed().max_by(|(_, a), (_, b)| a.loop_p50_us.total_cmp(&b.loop_p50_us));
        let found = timed().find(|(node, _)| node.kind == "master").or_else(slowest);
        (found.map(|(node, _)| node.name.clone()), found.map(|(_, t)| t.loop_p50_us), found.map(|(_, t)| t.loop_p99_us))
    }

    fn latest_node(&self) -> Option<(String, u64)> {
        let (node, status) = self.running().filter(|(_, t)| t.missed_deadlines > 0).max_by_key(|(_, t)| t.missed_deadlines)?;
        Some((node.name.clone(), status.missed_deadlines))
    }

    /// What is known when all have ended.
    pub fn report(&mut self) -> RunReport {
        let now = Instant::now();
        let steps = self.steps();
        let duration_s = self.start.map_or(0.0, |s| seconds_since(self.finished.unwrap_or(now), s.at).max(0.0));
        let (loop_node, loop_p50_us, loop_p99_us) = self.loop_times();
        let recorder = self.slots.iter().find(|s| s.plan.records).and_then(|s| s.members.first()?.status);
        let lost = self.running().map(|(_, s)| s.lost).sum();
        let missed_deadlines = self.running().map(|(_, s)| s.missed_deadlines).sum();
        let of_slot = |s: &Slot| -> Vec<NodeReport> {
            let others = || s.plan.nodes().map(|n| n.name).collect::<Vec<_>>();
            let report = |m: &Member| NodeReport {
                name: m.node.name.clone(),
                kind: m.node.kind.clone(),
                status: m.status,
                restarts: s.restarts,
                end: s.end.clone(),
                with: others().into_iter().filter(|name| *name != m.node.name).collect(),
            };
            s.members.iter().map(report).collect()
        };
        let nodes = self.slots.iter().flat_map(of_slot);
        RunReport {
            id: self.directory.paths().id().to_string(),
            title: self.plan.title.clone(),
            clock: self.plan.timing.clock,
            rate_hz: Some(self.plan.timing.rate_hz),
            steps,
            planned_steps: self.plan.timing.steps,
            startup_s: seconds_since(self.connected.unwrap_or(now), self.begun),
            duration_s,
            steps_per_s: if duration_s > 0.0 { steps as f64 / duration_s } else { 0.0 },
            loop_node,
            loop_p50_us,
            loop_p99_us,
            refused: self.statuses().map(|s| s.refused).sum(),
            missed_deadlines,
            latest_node: self.latest_node(),
            lost,
            unrecorded: recorder.map(|s| s.lost),
            bag: self.plan.bag.clone(),
            recorded: recorder.and_then(|s| s.recorded),
            nodes: nodes.collect(),
            events: std::mem::take(&mut self.events),
            events_left_out: self.events_left_out,
            deaths: std::mem::take(&mut self.deaths),
            killed: std::mem::take(&mut self.killed),
            cause: self.cause.take().or(self.loss.take()).unwrap_or(Cause::Completed),
            outcome: None,
            peak_contact_force_n: None,
        }
    }
}

impl std::fmt::Display for RunEvent {
    /// Such as `slave: warning at step 3241: the command is stale [stale]`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let severity = match self.severity {
            0 => "info",
            1 => "warning",
            _ => "error",
        };
        match (self.node.as_str(), self.step) {
            ("supervisor", _) => write!(f, "{severity}: {}", self.text),
            (node, Some(step)) => write!(f, "{node}: {severity} at step {step}: {} [{}]", self.text, self.kind),
            (node, None) => write!(f, "{node}: {severity}: {} [{}]", self.text, self.kind),
        }
    }
}
