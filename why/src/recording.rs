//! A recording of which it is asked why its loop shakes.

use crate::answer::{Answer, PATIENCE, Question, WhyError, why};
use crate::foreign::why_of_signals;
use backdrive_bags::Reader;
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::{Graph, Overrides};
use backdrive_stability::asked::own_gain;
use backdrive_stability::by_itself::recorded::Recorded;
use backdrive_stability::resimulate::recover::{recorded_intents, recover_intent};
use backdrive_stability::roles::Roles;
use backdrive_stability::session::Session;
use backdrive_stability::summary::{SummaryError, graph_of};
use std::fmt::Display;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A recording, or a roles file, that cannot be read: a sentence.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct RecordingError(String);

impl RecordingError {
    /// Of an error as a sentence.
    pub(crate) fn of(error: &dyn Display) -> RecordingError {
        RecordingError(error.to_string())
    }
}

fn wrong(error: impl Display) -> RecordingError {
    RecordingError(error.to_string())
}

/// A recording.
pub struct Recording {
    /// Its signals.
    pub session: Session,
    pub(crate) ours: Option<Ours>,
}

/// What a bag of a run holds besides its signals.
pub(crate) struct Ours {
    pub(crate) graph: Graph,
    pub(crate) recorded: Recorded,
    pub(crate) intents: Option<Vec<Intent>>,
}

impl Recording {
    /// Reads the bag of a run or, where a roles file is given, a recording of others.
    ///
    /// # Errors
    /// The recording or the roles file cannot be read, or a bag without roles holds no graph.
    pub fn read(path: &Path, roles: Option<&Path>) -> Result<Recording, RecordingError> {
        if let Some(roles) = roles {
            let session = Session::from_roles(path, &Roles::load(roles).map_err(wrong)?).map_err(wrong)?;
            return Ok(Recording { session, ours: None });
        }
        let reader = Reader::open_begun(path).map_err(wrong)?;
        let graph = graph_of(&reader, &Overrides::default()).map_err(|e| match e {
            SummaryError::NoGraph { .. } => RecordingError(format!("{e}; a recording that backdrive did not make needs --roles FILE")),
            _ => wrong(e),
        })?;
        let mut session = Session::from_bag(&reader, &graph).map_err(wrong)?;
        let recorded = Recorded::read(&reader).map_err(wrong)?;
        let mut intents = recorded_intents(&session);
        if intents.is_none() {
            match recover_intent(&session, &graph) {
                Ok(found) => {
                    session.notes.push("the hand was not recorded: it was recovered from x_m and F_f by the master's model".to_string());
                    intents = Some(found.intents);
                }
                Err(e) => session.notes.push(format!("the hand was not recorded and could not be recovered: {e}")),
            }
        }
        Ok(Recording { session, ours: Some(Ours { graph, recorded, intents }) })
    }

    /// The graph of the bag of a run.
    pub fn graph(&self) -> Option<&Graph> {
        self.ours.as_ref().map(|ours| &ours.graph)
    }

    /// Why its loop shakes, and what would stop it. `report` hears the stages of the work, and `cancel` ends it.
    ///
    /// # Errors
    /// A node cannot be run by itself, the loop cannot be re-simulated, or the work was ended.
    pub fn why(&self, report: &(dyn Fn(&str) + Sync), cancel: &Arc<AtomicBool>) -> Result<Answer, WhyError> {
        let gain = own_gain(&self.session, self.graph());
        let Some(Ours { graph, recorded, intents }) = &self.ours else { return Ok(why_of_signals(&self.session, gain)) };
        let question = Question { session: &self.session, graph, recorded, intents: intents.clone(), gain, patience: PATIENCE };
        why(&question, report, cancel)
    }
}
