//! One input of a stage: holds samples back until their step has come, and counts those that never came.

use crate::impair::Line;
use crate::stage::InputPort;
use crate::transport::{Subscriber, TransportError};
use backdrive_control::core::Port;
use backdrive_msgs::{Message, Sample};

/// Steps for which a real-time stage waits in vain before it takes an input for dead and no longer
/// waits for it. Otherwise a dead peer would make every stage behind it late, each by a whole period.
const PATIENCE: u32 = 3;

/// An input port with its subscriber.
pub(crate) struct Input {
    pub topic: String,
    /// The core does not see it: it only holds the stage back (see PACE_PORT).
    pub is_gate: bool,
    /// Samples found missing by sequence number.
    pub lost: u64,
    delay: u64,
    line: Option<Line>,
    subscriber: Box<dyn Subscriber>,
    /// Received, but of a later step than the port may hold.
    ahead: Option<Sample>,
    /// The newest that synchronisation has let through.
    newest: Option<Sample>,
    /// What the next sequence number should be; `None` where the topic was already running.
    expected: Option<u64>,
    waited_in_vain: u32,
}

impl Input {
    pub fn new(port: &InputPort, rate_hz: f64, is_gate: bool, subscriber: Box<dyn Subscriber>) -> Input {
        let line = port.impairment.as_ref().map(|i| Line::new(i, rate_hz));
        Input {
            topic: port.topic.name.clone(),
            is_gate,
            lost: 0,
            delay: port.delay,
            line,
            subscriber,
            ahead: None,
            newest: None,
            expected: Some(0),
            waited_in_vain: 0,
        }
    }

    pub fn has_publisher(&self) -> bool {
        self.subscriber.has_publisher()
    }

    /// Messages whose sender is not of the run.
    pub fn refused(&self) -> u64 {
        self.subscriber.refused()
    }

    /// Who else sends on the topic before the start.
    pub fn stranger(&mut self) -> Option<TransportError> {
        self.subscriber.stranger()
    }

    /// The graph has been running: whatever sequence number comes first is not a loss.
    pub fn join_late(&mut self) {
        self.expected = None;
    }

    /// Samples that came after a later one.
    pub fn late(&self) -> u64 {
        self.subscriber.late()
    }

    /// Only what is still missing is worth waking up for.
    pub fn set_awaited(&mut self, awaited: bool) {
        self.subscriber.set_awaited(awaited);
    }

    /// Takes in what has arrived, and returns whether the port is satisfied for `step`.
    pub fn poll(&mut self, step: u64) -> Result<bool, TransportError> {
        let Some(wanted) = step.checked_sub(self.delay) else {
            return Ok(true);
        };
        loop {
            // A publisher sends each step once and in order, so there is nothing to look for behind the wanted one.
            if self.newest.as_ref().is_some_and(|s| s.step >= wanted) {
                return Ok(true);
            }
            if self.ahead.is_none() {
                match self.subscriber.receive()? {
                    Some(Message::Sample(sample)) => {
                        self.count(&sample);
                        self.ahead = Some(sample);
                    }
                    Some(_) => continue,
                    None => return Ok(false),
                }
            }
            if self.ahead.as_ref().is_some_and(|s| s.step > wanted) {
                return Ok(true);
            }
            if let Some(sample) = self.ahead.take() {
                self.accept(sample);
            }
        }
    }

    fn accept(&mut self, sample: Sample) {
        if self.newest.as_ref().is_some_and(|n| sample.step <= n.step) {
            return;
        }
        if let Some(line) = &mut self.line {
            line.insert(&sample, sample.step + self.delay);
        }
        self.newest = Some(sample);
    }

    fn count(&mut self, sample: &Sample) {
        if let Some(expected) = self.expected {
            // A publisher that was started again counts from 0: that is no loss of ours.
            self.lost += sample.sequence.saturating_sub(expected);
        }
        self.expected = Some(sample.sequence + 1);
    }

    /// Whether a real-time stage should still wait for it.
    pub fn is_worth_waiting_for(&self) -> bool {
        self.waited_in_vain < PATIENCE
    }

    /// The stage does `step` now: what the core sees. Remembers whether it was waited for in vain.
    pub fn port(&mut self, step: u64, satisfied: bool) -> Port {
        let lag = self.delay + self.line.as_ref().map_or(0, |l| l.delay);
        let held = match &mut self.line {
            Some(line) => line.take(step),
            None => self.newest.as_ref(),
        };
        let nearly = self.newest.as_ref().is_some_and(|s| s.step + self.delay + 1 >= step);
        self.waited_in_vain = if satisfied || nearly { 0 } else { (self.waited_in_vain + 1).min(PATIENCE) };
        Port { sample: held.copied(), age_steps: age(step, lag, held.map(|s| s.step)) }
    }
}

/// Steps since the sample that should be here at `step` on a connection that lags by `lag` steps. It is 0 before the first can be here, and counted
/// as if step -1 had been the last while there is none.
pub(crate) fn age(step: u64, lag: u64, held: Option<u64>) -> u64 {
    match (step.checked_sub(lag), held) {
        (None, _) => 0,
        (Some(due), Some(held)) => due.saturating_sub(held),
        (Some(due), None) => due + 1,
    }
}
