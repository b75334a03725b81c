//! Where a bag differs from its own graph, in words, without the loop being re-simulated: what two sessions are compared by.

use crate::answer::WhyError;
use crate::cause_kind::CauseKind;
use crate::differences::{Look, differences};
use crate::named::named;
use crate::recording::RecordingError;
use backdrive_bags::Reader;
use backdrive_nodes::graph::Overrides;
use backdrive_stability::by_itself::recorded::Recorded;
use backdrive_stability::summary::graph_of;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// A difference below this share of a signal counts as none.
const SMALL: f64 = 0.02;

/// A difference of a recording from its graph.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// What it is.
    pub kind: CauseKind,
    /// Where: a node or an input of one.
    pub place: String,
    /// In a sentence.
    pub evidence: String,
}

/// Every node of a bag's graph by itself on its recorded inputs: where its output is not the recorded one. Effects of a device that no number explains are
/// not searched; [`crate::answer::why`] does.
///
/// # Errors
/// The bag cannot be read or has no graph, or a node cannot be run by itself.
pub fn seen(bag: &Path, cancel: &AtomicBool) -> Result<Vec<Seen>, RecordingError> {
    let wrong = |e: &dyn std::fmt::Display| RecordingError::of(e);
    let reader = Reader::open_begun(bag).map_err(|e| wrong(&e))?;
    let graph = graph_of(&reader, &Overrides::default()).map_err(|e| wrong(&e))?;
    let recorded = Recorded::read(&reader).map_err(|e| wrong(&e))?;
    let look = Look { small: SMALL, patience: Duration::ZERO };
    let found = differences(&graph, &recorded, &look, &|_| {}, cancel).map_err(|e| wrong(&WhyError::from(e)))?;
    let of = |difference| {
        let (kind, place, evidence) = named(difference, &graph);
        Seen { kind, place, evidence }
    };
    Ok(found.found.iter().map(of).collect())
}
