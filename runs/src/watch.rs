//! Who watches a run.

use backdrive_launch::RunPaths;
use std::any::Any;
use std::sync::mpsc::Sender;

/// What a run reports while it lasts.
pub trait Watch {
    /// A note or a warning: a sentence.
    fn note(&self, _sentence: &str) {}

    /// Something begins that may take long and counts no steps; it lasts until the result is dropped.
    fn begins(&self, _doing: &str) -> Box<dyn Any> {
        Box::new(())
    }

    /// Program and first arguments of a node's process; empty for the program of this process.
    fn node_command(&self) -> Vec<String> {
        Vec::new()
    }

    /// Who is to hear where a run of processes is, as soon as it has a place and before its nodes meet.
    fn created(&self) -> Option<Sender<RunPaths>> {
        None
    }

    /// `done` of `all` steps of the run of this title are done. The run has ended where both are equal.
    fn steps(&self, _title: &str, _done: u64, _all: u64) {}
}

/// Nobody watches.
pub struct Silent;

impl Watch for Silent {}
