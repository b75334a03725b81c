//! How other threads reach a running node, and what it reports to them.

use crate::protocol::{NodeStatus, Note};
use backdrive_msgs::{Gains, LAYOUT};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// How a node runs, beyond the settings of the graph.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Real time: a stage that is further behind than this, s, skips to the step that is due. Long
    /// enough for what a busy virtual machine withholds in a piece, short enough that forces are never
    /// computed from a time that the hand has left.
    pub horizon_s: f64,
    /// Real time: whether it looks at the clock until a step is due, in place of sleeping.
    pub polls: bool,
    /// Listeners that each topic should have before the run may start, by name of the topic.
    pub listeners: BTreeMap<String, usize>,
}

impl Default for Options {
    fn default() -> Options {
        Options { horizon_s: 0.25, polls: false, listeners: BTreeMap::new() }
    }
}

/// Longest time without a look at [`Control`], ns.
pub(super) const SLICE_NS: i64 = 20_000_000;

/// How other threads reach a node that runs.
#[derive(Debug, Default)]
pub struct Control {
    stop: AtomicBool,
    pub(super) has_gains: AtomicBool,
    pub(super) gains: Mutex<Vec<Gains>>,
    pub(super) has_asked: AtomicBool,
    pub(super) asked: Mutex<Vec<Asked>>,
}

/// What may be asked of a running node beside gains.
#[derive(Debug, Clone)]
pub(super) enum Asked {
    /// The canceller: whether it subtracts, and over how many seconds it fades.
    Canceller(bool, f64),
    /// An event of somebody else.
    Note(Note),
}

impl Control {
    /// Ends the run after the step at hand.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::SeqCst);
    }

    /// Whether [`Control::stop`] was called.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Wants other gains from the next step on: scales without unit, and a ramp in s.
    pub fn set_gains(&self, mu: f64, lambda: f64, ramp_s: f64) {
        let gains = Gains { layout: LAYOUT, source: 0, step: 0, sequence: 0, stamp_ns: 0, mu, lambda, ramp_s };
        self.gains.lock().unwrap_or_else(PoisonError::into_inner).push(gains);
        self.has_gains.store(true, Ordering::SeqCst);
    }

    /// Leaves the canceller out of the loop or takes it back, faded over `ramp_s` seconds.
    pub fn switch_canceller(&self, on: bool, ramp_s: f64) {
        if ramp_s.is_finite() && ramp_s >= 0.0 {
            self.ask(Asked::Canceller(on, ramp_s));
        }
    }

    /// Has an event published at the next step.
    pub fn note(&self, note: Note) {
        self.ask(Asked::Note(note));
    }

    fn ask(&self, asked: Asked) {
        self.asked.lock().unwrap_or_else(PoisonError::into_inner).push(asked);
        self.has_asked.store(true, Ordering::SeqCst);
    }
}

/// What a running node reports to its observer. Small and without a heap, because it is sent while stepping.
#[derive(Debug, Clone, Copy)]
pub enum Told {
    /// An event, in its published form.
    Event(backdrive_msgs::Event),
    /// About ten times a second of real time.
    Status {
        /// [`backdrive_msgs::source_id`] of the node that it is of.
        source: u32,
        /// How that node is doing.
        status: NodeStatus,
    },
}
