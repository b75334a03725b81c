//! What a run gave.

use backdrive_launch::{Cause, RunEvent, RunReport};
use backdrive_stability::summary::Summary;
use std::path::PathBuf;

/// What a run gave.
pub struct Done {
    /// Steps done by the node that did most.
    pub steps: u64,
    /// Wall-clock time, s.
    pub duration_s: f64,
    /// From the supervisor; `None` for a run in one process.
    pub report: Option<RunReport>,
    /// Messages that are not in the bag, and samples that a node did not get.
    pub lost: u64,
    /// The bag, if one was recorded.
    pub bag: Option<PathBuf>,
    /// Whether its recorder ended and nothing is missing in it.
    pub complete: bool,
    /// Why the bag cannot be read, where it cannot.
    pub unreadable: Option<String>,
    /// What happened.
    pub summary: Option<Summary>,
}

/// What went wrong with a run, whatever its loop did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// A node failed with this exit code, which is not 0.
    Exit(u8),
    /// A node died, or the run ended early.
    Node,
    /// A stranger spoke on the topics of the run.
    Stranger,
    /// Somebody stopped it.
    Stopped,
    /// Messages were lost, or the bag cannot be read.
    Lost,
}

/// Events after which a device takes no part in its run any more.
const DEVICE_LOST: [&str; 3] = ["device_gone", "device_too_hot", "device_current_limit"];

/// The first event by which a run lost one of its devices.
pub(crate) fn lost_device(report: &RunReport) -> Option<&RunEvent> {
    report.events.iter().find(|event| DEVICE_LOST.contains(&event.kind.as_str()))
}

impl Done {
    /// What went wrong, if anything did.
    pub fn fault(&self) -> Option<Fault> {
        if let Some(report) = &self.report {
            match &report.cause {
                Cause::NodeFailed { code, .. } if *code != 0 => return Some(Fault::Exit(*code)),
                Cause::NodeDied { .. } | Cause::NodeFailed { .. } | Cause::EndedEarly { .. } => return Some(Fault::Node),
                Cause::Stranger { .. } => return Some(Fault::Stranger),
                Cause::Stopped { .. } => return Some(Fault::Stopped),
                Cause::Completed if !report.orderly() => return Some(Fault::Node),
                // A run whose device went away is no success, whatever the rest of it did.
                Cause::Completed if lost_device(report).is_some() => return Some(Fault::Node),
                Cause::Completed => {}
            }
        }
        (self.lost > 0 || self.unreadable.is_some()).then_some(Fault::Lost)
    }

    /// Why it did not go to its end, or why its bag cannot be read: a line of its text.
    pub fn ended(&self) -> Option<String> {
        let cause = self.report.as_ref().map(|report| &report.cause).filter(|cause| **cause != Cause::Completed);
        let cause = cause.map(|cause| format!("ended    {cause}"));
        let device = self.report.as_ref().and_then(lost_device);
        let cause = cause.or_else(|| device.map(|event| format!("device   {}: {}", event.node, event.text)));
        cause.or_else(|| self.unreadable.as_ref().map(|why| format!("UNREADABLE {why}")))
    }
}
