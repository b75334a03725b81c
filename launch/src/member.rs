//! What is known of one node, over all lives of its process.

use crate::plan::Named;
use backdrive_nodes::protocol::NodeStatus;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Peaks of the last second, as many as there can be status messages.
const PEAKS: usize = 32;

/// One of the nodes of a process; most have one.
#[derive(Debug, Default)]
pub(crate) struct Member {
    pub node: Named,
    pub status: Option<NodeStatus>,
    /// Missed deadlines, losses and refusals of former lives.
    pub before: (u64, u64, u64),
    pub peak: f64,
    peaks: VecDeque<(Instant, f64)>,
}

impl Member {
    pub fn new(node: Named) -> Member {
        Member { node, ..Member::default() }
    }

    /// A new process begins to count from 0.
    pub fn begin(&mut self) {
        if let Some(status) = &self.status {
            self.before = (status.missed_deadlines, status.lost, status.refused);
        }
    }

    /// Takes the node's report on itself, and returns whether it has made progress.
    pub fn take_status(&mut self, mut status: NodeStatus, now: Instant) -> bool {
        status.missed_deadlines += self.before.0;
        status.lost += self.before.1;
        status.refused += self.before.2;
        let steps = self.status.as_ref().map_or(0, |s| s.steps);
        let recorded = self.status.as_ref().and_then(|s| s.recorded);
        let further = status.steps > steps || (status.recorded.is_some() && status.recorded != recorded);
        // A node that was started again may count from 0.
        status.steps = status.steps.max(steps);
        if status.peak_effort.is_finite() {
            self.peak = self.peak.max(status.peak_effort);
            self.peaks.push_back((now, status.peak_effort));
            while self.peaks.len() > PEAKS {
                self.peaks.pop_front();
            }
        }
        status.peak_effort = self.peak;
        self.status = Some(status);
        further
    }

    /// Largest effort of the last second, N.
    pub fn recent_peak(&self, now: Instant) -> Option<f64> {
        let recent = self.peaks.iter().filter(|(at, _)| now.saturating_duration_since(*at) < Duration::from_secs(1));
        recent.map(|(_, peak)| *peak).reduce(f64::max)
    }
}
