//! What is asked of a recording.

use crate::resimulate::Gain;
use crate::resimulate::edge::Search;
use crate::resimulate::script::Script;
use crate::session::Session;
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::Graph;
use serde::Serialize;

/// What is asked.
#[derive(Debug, Clone)]
pub struct Question<'a> {
    /// What was recorded.
    pub session: &'a Session,
    /// The graph that recorded it; `None` for a bag without models.
    pub recorded: Option<&'a Graph>,
    /// The same with parts exchanged.
    pub asked: Option<&'a Graph>,
    /// Which parts those are.
    pub swapped: Swapped,
    /// The hand's motion, per axis; `None` where it is not known.
    pub intents: Option<Vec<Intent>>,
    /// A hand to play in place of the recorded one.
    pub script: Option<Script>,
    /// The gains asked about.
    pub gain: Gain,
    /// Factors on the grip over which the answer is given; empty for none.
    pub grips: Vec<f64>,
    /// Where the stability limit is searched.
    pub search: Search,
}

/// Parts that are not those that recorded the bag.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Swapped {
    /// The master or its grip.
    pub master: bool,
    /// The canceller or the grip it assumes.
    pub canceller: bool,
    /// The slave or what it touches.
    pub slave: bool,
    /// What couples them.
    pub coupling: bool,
}

impl Swapped {
    /// Whether there is any.
    pub(super) fn any(&self) -> bool {
        self.master || self.canceller || self.slave || self.coupling
    }
}
