//! An element with a force of its own at work.

use crate::elements::Law;

/// An element with a force of its own at work.
#[derive(Debug, Clone)]
pub(super) struct PathElement {
    pub(super) first: usize,
    pub(super) second: usize,
    pub(super) law: Law,
    pub(super) memory: Vec<f64>,
    /// Where the trial of an implicit solution puts the memory.
    pub(super) trial: Vec<f64>,
    /// Displacement up to which the memory has come, m.
    pub(super) reached: f64,
    /// Force at the middle of the last substep, N.
    pub(super) force: f64,
    /// Relative velocity before the last substep, m/s.
    pub(super) velocity_before: f64,
    /// Index among the constraints when it is solved implicitly.
    pub(super) constraint: Option<usize>,
    /// How far ahead of the start of a substep its force is then taken, s.
    pub(super) ahead: f64,
    /// Whether that is the end of the substep, because it is too stiff for more.
    pub(super) unresolved: bool,
    /// How fast the left side of its implicit equation (see `constraints.rs`) rose when it was solved last; 1 without its force.
    pub(super) rise: f64,
    /// What its force took out of the bodies so far, J.
    pub(super) absorbed: f64,
}

impl PathElement {
    /// At rest between two places.
    pub(super) fn new(first: usize, second: usize, law: &Law) -> PathElement {
        let memory = vec![0.0; law.memory_len()];
        PathElement {
            first,
            second,
            law: law.clone(),
            trial: memory.clone(),
            memory,
            reached: 0.0,
            force: 0.0,
            velocity_before: 0.0,
            constraint: None,
            ahead: 0.0,
            unresolved: false,
            rise: 1.0,
            absorbed: 0.0,
        }
    }
}
