//! What a node reports beside its samples: events, gains and status, as the messages they become.
//!
//! The processes and the single-process executor share it, so that both report the same.

use crate::sentences::sentence;
use crate::stage::{Clock, Timing};
use backdrive_control::core::Events;
use backdrive_control::live_margin::MarginEstimate;
use backdrive_msgs::text::Text;
use backdrive_msgs::{Event, Gains, LAYOUT, Margin, NOT_MEASURED, Status, source_id};

/// What a node keeps for its events, gains and status.
#[derive(Debug)]
pub(crate) struct Book {
    pub source: u32,
    clock: Clock,
    rate_hz: f64,
    events: u64,
    status: u64,
    gains: u64,
    gains_told: Option<(f64, f64)>,
    status_every: u64,
    status_due: u64,
    margins: u64,
    margin_due: u64,
}

/// Stamp of what is made at `step` in lockstep: simulated ns since the start.
pub(crate) fn simulated_ns(step: u64, rate_hz: f64) -> i64 {
    (step as f64 * 1e9 / rate_hz).round() as i64
}

/// The parts of a status that the node must look up.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Health {
    pub missed_deadlines: u64,
    pub lost: u64,
    pub loop_p50_s: f64,
    pub loop_p99_s: f64,
}

impl Book {
    pub fn new(node: &str, timing: &Timing) -> Book {
        let status_every = (timing.rate_hz / 10.0).round().max(1.0) as u64;
        Book {
            source: source_id(node),
            clock: timing.clock,
            rate_hz: timing.rate_hz,
            events: 0,
            status: 0,
            gains: 0,
            gains_told: None,
            status_every,
            status_due: status_every,
            margins: 0,
            margin_due: status_every,
        }
    }

    /// Stamp of what is made at `step` in lockstep: simulated ns since the start.
    pub fn simulated_ns(&self, step: u64) -> i64 {
        simulated_ns(step, self.rate_hz)
    }

    /// An event with its own text.
    pub fn event(&mut self, step: u64, stamp_ns: i64, kind: &str, value: f64, severity: u32, text: Text<128>) -> Event {
        let sequence = self.events;
        self.events += 1;
        Event { layout: LAYOUT, source: self.source, step, sequence, stamp_ns, severity, reserved: 0, value, kind: Text::new(kind), text }
    }

    /// Removes what a core has noted, one message each.
    pub fn drain(&mut self, step: u64, stamp_ns: i64, noted: &mut Events, mut each: impl FnMut(&'static str, Event)) {
        let dropped = std::mem::take(&mut noted.dropped);
        for (kind, value, severity) in noted.drain() {
            each(kind, self.event(step, stamp_ns, kind, value, severity, sentence(kind, value)));
        }
        if dropped > 0 {
            let value = dropped as f64;
            each("events_dropped", self.event(step, stamp_ns, "events_dropped", value, 1, sentence("events_dropped", value)));
        }
    }

    /// The gains in force at `step`, if they differ from those last reported.
    pub fn gains(&mut self, step: u64, stamp_ns: i64, now: (f64, f64)) -> Option<Gains> {
        let bits = |g: (f64, f64)| (g.0.to_bits(), g.1.to_bits());
        if self.gains_told.is_some_and(|told| bits(told) == bits(now)) {
            return None;
        }
        self.gains_told = Some(now);
        let sequence = self.gains;
        self.gains += 1;
        Some(Gains { layout: LAYOUT, source: self.source, step, sequence, stamp_ns, mu: now.0, lambda: now.1, ramp_s: 0.0 })
    }

    /// The margin after `step`, every 0.1 s of the graph's time.
    pub fn margin(&mut self, step: u64, stamp_ns: i64, now: impl FnOnce() -> Option<MarginEstimate>) -> Option<Margin> {
        let steps = step + 1;
        if steps < self.margin_due {
            return None;
        }
        let MarginEstimate { axis, known, gain, factor, deviation, frequency_hz, decay_per_s } = now()?;
        self.margin_due = (steps / self.status_every + 1) * self.status_every;
        let sequence = self.margins;
        self.margins += 1;
        let source = self.source;
        Some(Margin { layout: LAYOUT, source, step, sequence, stamp_ns, axis, known, gain, factor, deviation, frequency_hz, decay_per_s })
    }

    /// The status after `step`, every 0.1 s of the graph's time. A lockstep one holds nothing that the machine decides.
    pub fn status(&mut self, step: u64, stamp_ns: i64, health: impl FnOnce() -> Health) -> Option<Status> {
        let steps = step + 1;
        if steps < self.status_due {
            return None;
        }
        self.status_due = (steps / self.status_every + 1) * self.status_every;
        let sequence = self.status;
        self.status += 1;
        let Health { missed_deadlines, lost, loop_p50_s, loop_p99_s } = match self.clock {
            Clock::Lockstep => Health::default(),
            Clock::Realtime => health(),
        };
        Some(Status {
            layout: LAYOUT,
            source: self.source,
            step,
            sequence,
            stamp_ns,
            steps,
            missed_deadlines,
            lost,
            loop_p50_s,
            loop_p99_s,
        })
    }
}

/// Gains that are wanted, until the steps come from which they hold.
#[derive(Debug, Default)]
pub(crate) struct Wanted {
    list: [Option<Gains>; 16],
    len: usize,
}

impl Wanted {
    /// Keeps them; the one due last makes room when there are too many.
    pub fn push(&mut self, gains: Gains) {
        if let Some(slot) = self.list.iter_mut().find(|g| g.is_none()) {
            *slot = Some(gains);
            self.len += 1;
        } else if let Some(slot) = self.list.iter_mut().max_by_key(|g| g.map(|g| g.step)) {
            *slot = Some(gains);
        }
    }

    /// Removes the next that holds from `step` or earlier, in order of step.
    #[inline]
    pub fn due(&mut self, step: u64) -> Option<Gains> {
        if self.len == 0 {
            return None;
        }
        let due = |g: &Option<Gains>| g.is_some_and(|g| g.step <= step);
        let slot = self.list.iter_mut().filter(|g| due(g)).min_by_key(|g| g.map(|g| (g.step, g.sequence)))?;
        self.len -= 1;
        slot.take()
    }
}

/// Whether gains can be: numbers, and a ramp that does not run backwards.
pub(crate) fn gains_are_valid(gains: &Gains) -> bool {
    gains.mu.is_finite() && gains.lambda.is_finite() && gains.ramp_s.is_finite() && gains.ramp_s >= 0.0
}

/// A number to go with an event that has none.
pub(crate) const NO_VALUE: f64 = NOT_MEASURED;
