//! What a runner keeps for each of its nodes beside their stages.

use super::stage::Output;
use super::teller::Teller;
use crate::histogram::Histogram;
use crate::protocol::NodeStatus;
use crate::transport::Subscriber;

/// One of the nodes that a runner drives; most drive one.
pub(super) struct Member {
    pub(super) name: String,
    pub(super) teller: Teller,
    pub(super) gains_in: Option<Box<dyn Subscriber>>,
    pub(super) gains_out: Option<Output>,
    pub(super) margin_out: Option<Output>,
    pub(super) lists: Vec<Output>,
    /// Step from which the next lists are due.
    pub(super) lists_due: u64,
    pub(super) loop_time: Histogram,
    pub(super) loop_time_recent: Histogram,
    /// Steps left out because the node was too far behind.
    pub(super) skipped: u64,
    /// Late samples that were reported, and when, ns.
    pub(super) late_told: (u64, i64),
}

impl Member {
    /// Outputs beside those of its stages.
    pub(super) fn side_outputs(&self) -> impl Iterator<Item = &Output> {
        [&self.teller.events, &self.teller.status].into_iter().chain(&self.gains_out).chain(&self.margin_out).chain(&self.lists)
    }

    /// Its figures, with what its stages lost and refused, and times from this histogram.
    pub(super) fn report(&self, (lost, refused): (u64, u64), times: &Histogram) -> NodeStatus {
        let us = |q: f64| times.quantile(q) * 1e-3;
        let refused = refused + self.gains_in.as_ref().map_or(0, |gains| gains.refused());
        NodeStatus { lost, refused, loop_p50_us: us(0.5), loop_p99_us: us(0.99), ..self.teller.report }
    }
}
