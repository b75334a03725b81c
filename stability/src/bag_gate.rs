//! What in a bag of ours forbids a green answer: one function, so that every verb that judges gives the same.

use crate::by_itself::against::{Against, against};
use crate::model_check::check;
use crate::outcome::Outcome;
use crate::part_check::PartCheck;
use crate::session::Session;
use crate::signal_role::SessionError;
use crate::unjudged::Unjudged;
use crate::verdict::recorded_outcome;
use backdrive_bags::{Account, Fault, Reader};
use backdrive_msgs::topic::Kind;
use backdrive_nodes::graph::Graph;

/// The result of examining a whole bag.
pub(crate) struct Gate {
    /// What keeps a green answer back, whatever its rows show; `None` where nothing does.
    pub(crate) kept_back: Option<Unjudged>,
    /// What a reader of the answers has to know of it.
    pub(crate) notes: Vec<String>,
    /// Devices beside their models.
    pub(crate) parts: Vec<PartCheck>,
}

/// More of a topic's messages than this must not be missing, as no more of the loop's steps may.
const MOST_MISSING: f64 = 0.01;

/// Examines a bag: every message is counted, and the record of each node is compared with its graph.
pub(crate) fn gate(reader: &Reader, graph: &Graph) -> Result<Gate, SessionError> {
    let account = Account::of(reader)?;
    let Against { contradictions, parts, notes: of_nodes } = against(reader, graph)?;
    let mut notes: Vec<String> = account.notes.iter().map(|note| format!("the bag: {note}")).collect();
    let faults = account.faults.iter().filter(|fault| !matches!(fault, Fault::NotClosed | Fault::Lost { .. }));
    notes.extend(faults.map(|fault| format!("the bag: {fault}")));
    let missing = account.faults.iter().filter_map(|fault| match fault {
        Fault::Lost { topic, messages, of } => Some(format!("{topic} {messages} of {of}")),
        _ => None,
    });
    let missing: Vec<String> = missing.collect();
    if !missing.is_empty() {
        notes.push(format!("the bag lacks messages: {}", missing.join(", ")));
    }
    notes.extend(contradictions.iter().map(|what| format!("the recording contradicts its graph: {what}")));
    notes.extend(of_nodes);
    let contradicts = !contradictions.is_empty() || account.contradictions().next().is_some();
    let end = account.faults.iter().find_map(|fault| match fault {
        Fault::EndUnknown | Fault::NotClosed => Some(Unjudged::NotClosed),
        Fault::Short { steps, of } => Some(Unjudged::CutShort { steps: *steps as usize, of: *of as usize }),
        _ => None,
    });
    let is_closed_by_plan = graph.timing.steps.is_some_and(|steps| account.last_step.is_some_and(|last| last + 1 >= steps));
    // What was recorded as no number was not recorded.
    let silent =
        || parts.iter().map(|part| part.silent).max().filter(|steps| *steps > 0).map(|steps| Unjudged::Lost { messages: steps as u64 });
    let kept_back = contradicts
        .then_some(Unjudged::Contradictory)
        .or(end.filter(|_| !is_closed_by_plan))
        .or_else(|| lost(&account, reader))
        .or_else(silent);
    Ok(Gate { kept_back, notes, parts })
}

/// Whether samples are missing beyond what a loop bridges.
fn lost(account: &Account, reader: &Reader) -> Option<Unjudged> {
    let is_sample = |name: &str| {
        let told = reader.header().and_then(|header| header.topics.iter().find(|info| info.topic.name == name));
        told.is_some_and(|info| info.topic.kind == Kind::Sample)
    };
    let beyond = account.faults.iter().any(|fault| match fault {
        Fault::Lost { topic, messages, of } => is_sample(topic) && *messages as f64 > MOST_MISSING * *of as f64,
        _ => false,
    });
    beyond.then(|| Unjudged::Lost { messages: account.lost() })
}

/// What in a recording prevents the answer "stable" for a re-simulation of its loop: the same conditions as those of `stability` for the bag at its own
/// gain. The notes say what it is in detail.
///
/// # Errors
/// The bag cannot be read.
pub fn held_back(reader: &Reader, graph: &Graph, exchanged: bool) -> Result<(Option<Unjudged>, Vec<String>), SessionError> {
    let session = match Session::from_bag(reader, graph) {
        Ok(session) => session,
        // Without a loop nothing is judged, and what is missing is missing nevertheless.
        Err(SessionError::Missing { .. }) => {
            let Gate { kept_back, notes, .. } = gate(reader, graph)?;
            return Ok((kept_back, notes));
        }
        Err(other) => return Err(other),
    };
    let lossy = match recorded_outcome(&session) {
        Some(Outcome::NotJudged { why }) if why.is_loss() => Some(why),
        _ => None,
    };
    let why = session.cut_short.or(lossy).or_else(|| if exchanged { None } else { models_apart(graph, &session) });
    Ok((why, session.notes))
}

/// Whether a device of a recording does not do what its model does, so that a green answer about the graph would be one about another loop.
pub fn models_apart(graph: &Graph, session: &Session) -> Option<Unjudged> {
    let checks = check(graph, session).unwrap_or_default();
    checks.iter().chain(&session.parts).any(|part| !part.agrees).then_some(Unjudged::ModelsApart)
}
