//! A question about the stability of a recording, from what is asked to what the methods take.

use crate::resimulate::edge::Search;
use crate::resimulate::recover::{recorded_intents, recover_intent};
use crate::resimulate::script::Script;
use crate::resimulate::sweep::sweep;
use crate::resimulate::{Gain, Run, RunOptions, Scenario};
use crate::roles::Roles;
use crate::session::Session;
use crate::summary::{SummaryError, graph_of};
use crate::verdict::{Question, Swapped, is_coupled};
use backdrive_bags::Reader;
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Gain products that can be asked about. Beyond them the rounding of forces and positions decides, not the loop.
const SENSIBLE: [f64; 2] = [1e-6, 1e6];

/// What is asked of a recording.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The bag of a run; with `roles` any MCAP file, a rosbag2 folder, or a table.
    pub recording: PathBuf,
    /// File that states which topic or column is which, for a recording of others.
    pub roles: Option<PathBuf>,
    /// Parts of the graph that are swapped, and the law of its coupling.
    pub changes: Overrides,
    /// The gain product mu*lambda asked about, reached by lambda; `None` for `mu` and `lambda`.
    pub gain: Option<f64>,
    /// Position scale asked about; `None` for that of most of the recording.
    pub mu: Option<f64>,
    /// Force scale asked about; `None` for that of most of the recording.
    pub lambda: Option<f64>,
    /// Graph file whose operator takes the place of the recorded hand.
    pub script: Option<PathBuf>,
    /// Factors on stiffness and damping of the grip, over which the answer is given.
    pub grips: Vec<f64>,
}

/// A recording or an option that is wrong: a sentence.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct AskedError(pub(crate) String);

fn wrong(error: impl Display) -> AskedError {
    AskedError(error.to_string())
}

/// What a recording holds, and the graph that is asked about.
pub struct Asked {
    /// Its signals.
    pub session: Session,
    /// Its graph as recorded; `None` where roles are given.
    pub recorded: Option<Graph>,
    /// Its graph with the changes.
    pub graph: Option<Graph>,
    /// Whether the bag was not closed, so that what it holds is used.
    pub is_cut: bool,
    /// What the hand wanted, for each axis, where that was recorded or recovered.
    pub intents: Option<Vec<Intent>>,
}

impl Asked {
    /// Reads a recording.
    ///
    /// # Errors
    /// The recording or the roles cannot be read, or the graph does not take the changes.
    pub fn read(options: &Options) -> Result<Asked, AskedError> {
        let path = &options.recording;
        let changes = &options.changes;
        if let Some(roles) = &options.roles {
            if *changes != Overrides::default() {
                return Err(AskedError(format!(
                    "{}: contains no graph, so no part of it can be exchanged; omit the option",
                    path.display()
                )));
            }
            let roles = Roles::load(roles).map_err(wrong)?;
            let session = Session::from_roles(path, &roles).map_err(wrong)?;
            return Ok(Asked { session, recorded: None, graph: None, is_cut: false, intents: None });
        }
        if path.is_dir() {
            return Err(AskedError(which_bag(path)));
        }
        let reader = Reader::open_begun(path).map_err(wrong)?;
        let recorded = graph_of(&reader, &Overrides::default()).map_err(|e| match e {
            SummaryError::NoGraph { .. } => AskedError(format!("{e}; a bag that backdrive did not record needs --roles FILE")),
            _ => wrong(e),
        })?;
        let graph = graph_of(&reader, changes).map_err(wrong)?;
        let mut session = Session::from_bag(&reader, &recorded).map_err(wrong)?;
        let mut intents = recorded_intents(&session);
        if intents.is_none() && options.script.is_none() {
            match recover_intent(&session, &recorded) {
                Ok(found) => {
                    let worst = |values: &[f64]| values.iter().fold(0.0_f64, |a, b| a.max(*b));
                    session.notes.push(format!(
                        "the hand was not recorded: it was recovered from x_m and F_f by the master's model, which leaves {:.2} % of \
                         x_m's range. Dry friction makes its position uncertain by {:.2} mm",
                        100.0 * worst(&found.residual),
                        1e3 * worst(&found.ambiguity)
                    ));
                    intents = Some(found.intents);
                }
                Err(e) => session.notes.push(format!("the hand was not recorded and could not be recovered: {e}")),
            }
        }
        Ok(Asked { session, is_cut: !reader.ended_cleanly(), recorded: Some(recorded), graph: Some(graph), intents })
    }

    /// The question of it. `options` are those that it was read with.
    ///
    /// # Errors
    /// The gain cannot be asked about, or the script cannot be read.
    pub fn question(&self, options: &Options) -> Result<Question<'_>, AskedError> {
        let parts = &options.changes;
        // The sensors and limits of a device belong to its model.
        let mut swapped = Swapped {
            master: parts.master.is_some() || parts.grip.is_some(),
            canceller: parts.canceller.is_some() || parts.canceller_grip.is_some() || parts.high_pass_hz.is_some() || parts.hand.is_some(),
            slave: parts.slave.is_some() || parts.environment.is_some(),
            coupling: parts.coupling.is_some(),
        };
        if let Some(graph) = &self.graph {
            swapped.canceller &= graph.node_of(NodeKind::Canceller).is_some();
        }
        if is_coupled(&self.session) && (options.gain.is_some() || options.mu.is_some() || options.lambda.is_some()) {
            return Err(AskedError(format!(
                "{}: two coupled motors have no mu*lambda and are judged at the gains of the recording; omit --gain, --mu and --lambda",
                options.recording.display()
            )));
        }
        let own = own_gain(&self.session, self.recorded.as_ref());
        // A product is asked of a position scale.
        let own = Gain { mu: if own.mu == 0.0 { 1.0 } else { own.mu }, ..own };
        let gain = match (options.gain, options.mu, options.lambda) {
            (Some(product), ..) => Gain { mu: own.mu, lambda: product / own.mu },
            (None, mu, lambda) => Gain { mu: mu.unwrap_or(own.mu), lambda: lambda.unwrap_or(own.lambda) },
        };
        if gain.product() <= 0.0 {
            return Err(AskedError(format!(
                "{}: was recorded at mu*lambda = {}; name the gain to judge with --gain",
                options.recording.display(),
                gain.product()
            )));
        }
        if !(SENSIBLE[0]..=SENSIBLE[1]).contains(&gain.product()) {
            return Err(AskedError(format!(
                "mu*lambda = {:e} is out of range: gains from {:e} to {:e} are accepted, and stability limits are searched for from {:e} \
                    to {}",
                gain.product(),
                SENSIBLE[0],
                SENSIBLE[1],
                Search::default().floor,
                Search::default().highest
            )));
        }
        let script = options.script.as_deref().map(Script::from_graph).transpose().map_err(wrong)?;
        let search = Search::default();
        Ok(Question {
            session: &self.session,
            recorded: self.recorded.as_ref(),
            asked: self.graph.as_ref(),
            swapped,
            intents: self.intents.clone(),
            script,
            gain,
            grips: options.grips.clone(),
            search,
        })
    }
}

/// The gain of most of a recording; without gains in it those of the graph, else 1.
pub fn own_gain(session: &Session, graph: Option<&Graph>) -> Gain {
    let median = |column: &[f64]| {
        let mut values: Vec<f64> = column.iter().copied().filter(|x| x.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    Gain {
        mu: median(&session.mu).or(graph.map(|g| g.gains.mu)).unwrap_or(1.0),
        lambda: median(&session.lambda).or(graph.map(|g| g.gains.lambda)).unwrap_or(1.0),
    }
}

/// Runs the loop of a question again at each gain product. `hear` gets how many gains are done; a gain that `cancel` kept from being run is `None`.
///
/// # Errors
/// The recording holds no models or no hand, or the loop cannot be run again.
pub fn curve(
    question: &Question,
    gains: &[f64],
    hear: &(dyn Fn(usize) + Sync),
    cancel: &AtomicBool,
) -> Result<Vec<Option<(f64, Run)>>, AskedError> {
    let no = |why: &str| AskedError(format!("{}: a sweep re-simulates the loop, but {why}", question.session.name));
    let graph = question.asked.ok_or_else(|| no("this bag contains no models"))?;
    if question.intents.is_none() && question.script.is_none() {
        return Err(no("its hand was not recorded and could not be recovered; name one with --script"));
    }
    let rows = question.session.len() as u64;
    let mut scenario = Scenario::new(graph.clone(), question.intents.clone(), Some(rows)).map_err(wrong)?;
    if let Some(script) = &question.script {
        scenario = scenario.with_script(script);
    }
    sweep(&scenario, gains, &RunOptions::default(), hear, cancel).map_err(wrong)
}

/// What of a folder to name.
fn which_bag(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(|e| e.ok().map(|e| e.path()));
    let mut bags: Vec<String> = entries.filter(|p| p.extension().is_some_and(|e| e == "mcap")).map(|p| p.display().to_string()).collect();
    bags.sort();
    let name = folder.display();
    match &bags[..] {
        [] => format!("{name}: is a folder without a bag; name the .mcap file of a run"),
        [one] => format!("{name}: is a folder; name the bag in it, {one}, or with --roles FILE the folder as a rosbag2 recording"),
        [first, rest @ ..] => format!(
            "{name}: is a folder of {} bags; name one of them, such as {first}, or with --roles FILE the folder as a rosbag2 recording",
            rest.len() + 1
        ),
    }
}
