//! What a bag holds, and the question about it.

use crate::cli;
use crate::failure::Failure;
use crate::offered::with_recover;
use backdrive_bags::Reader;
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides};
use backdrive_stability::resimulate::Gain;
use backdrive_stability::resimulate::edge::Search;
use backdrive_stability::resimulate::recover::{recorded_intents, recover_intent};
use backdrive_stability::resimulate::script::Script;
use backdrive_stability::roles::Roles;
use backdrive_stability::session::Session;
use backdrive_stability::summary::graph_of;
use backdrive_stability::verdict::{Question, Swapped, is_coupled};

/// Gain products that can be asked about. Beyond them the rounding of forces and positions decides, not the loop.
const SENSIBLE: [f64; 2] = [1e-6, 1e6];

/// What a bag holds.
pub(super) struct Loaded {
    pub(super) session: Session,
    pub(super) recorded: Option<Graph>,
    pub(super) asked: Option<Graph>,
    pub(super) intents: Option<Vec<Intent>>,
}

impl Loaded {
    pub(super) fn read(options: &cli::Stability) -> Result<Loaded, Failure> {
        let path = &options.recording;
        let changes = Overrides { coupling: options.coupling.clone(), ..options.parts.overrides() };
        if let Some(roles) = &options.roles {
            if changes != Overrides::default() {
                return Err(Failure::input(format!(
                    "{}: holds no graph, so no part of it can be exchanged; leave the part's option out",
                    path.display()
                )));
            }
            let roles = Roles::load(roles)?;
            let session = Session::from_roles(path, &roles).map_err(Failure::input)?;
            return Ok(Loaded { session, recorded: None, asked: None, intents: None });
        }
        if path.is_dir() {
            return Err(Failure::input(which_bag(path)));
        }
        let reader = Reader::open(path).map_err(Failure::input)?;
        let hint = |f: Failure| Failure { message: format!("{}; a bag that we did not record needs --roles FILE", f.message), ..f };
        let is_cut = reader.without_messages().is_some();
        let recorded = graph_of(&reader, &Overrides::default()).map_err(|e| if is_cut { e.into() } else { hint(e.into()) })?;
        let asked = graph_of(&reader, &changes)?;
        let mut session = Session::from_bag(&reader, &recorded).map_err(Failure::input)?;
        if !reader.ended_cleanly() {
            session.notes.push(with_recover("the bag was not closed: what it holds is used", path));
        }
        let mut intents = recorded_intents(&session);
        if intents.is_none() && options.script.is_none() {
            match recover_intent(&session, &recorded) {
                Ok(found) => {
                    let worst = |values: &[f64]| values.iter().fold(0.0_f64, |a, b| a.max(*b));
                    session.notes.push(format!(
                        "the hand was not recorded: it was recovered from x_m and F_f by the master's model, which leaves {:.2} % of x_m's range; \
                         dry friction hides where it was within {:.2} mm",
                        100.0 * worst(&found.residual),
                        1e3 * worst(&found.ambiguity)
                    ));
                    intents = Some(found.intents);
                }
                Err(e) => session.notes.push(format!("the hand was not recorded and could not be recovered: {e}")),
            }
        }
        Ok(Loaded { session, recorded: Some(recorded), asked: Some(asked), intents })
    }

    pub(super) fn question(&self, options: &cli::Stability) -> Result<Question<'_>, Failure> {
        let parts = &options.parts;
        // The sensors and limits of a device belong to its model.
        let mut swapped = Swapped {
            master: parts.master.is_some() || parts.grip.is_some(),
            canceller: parts.canceller.is_some() || parts.canceller_grip.is_some() || parts.high_pass.is_some() || parts.hand.is_some(),
            slave: parts.slave.is_some() || parts.environment.is_some(),
            coupling: options.coupling.is_some(),
        };
        if let Some(asked) = &self.asked {
            swapped.canceller &= asked.node_of(NodeKind::Canceller).is_some();
        }
        if is_coupled(&self.session) && (options.gain.is_some() || options.mu.is_some() || options.lambda.is_some()) {
            return Err(Failure::input(format!(
                "{}: two motors that are coupled have no mu*lambda, and are judged at the gains of the recording; leave --gain, --mu and --lambda out",
                options.recording.display()
            )));
        }
        let own = self.own_gain();
        let gain = match (options.gain, options.mu, options.lambda) {
            (Some(product), ..) => Gain { mu: own.mu, lambda: product / own.mu },
            (None, mu, lambda) => Gain { mu: mu.unwrap_or(own.mu), lambda: lambda.unwrap_or(own.lambda) },
        };
        if gain.product() <= 0.0 {
            return Err(Failure::input(format!(
                "{}: was recorded at mu*lambda = {}; say with --gain which gain is asked about",
                options.recording.display(),
                gain.product()
            )));
        }
        if !(SENSIBLE[0]..=SENSIBLE[1]).contains(&gain.product()) {
            return Err(Failure::input(format!(
                "mu*lambda = {:e} is beyond any sense: gains from {:e} to {:e} can be asked about, and edges are looked for from {:e} to {}",
                gain.product(),
                SENSIBLE[0],
                SENSIBLE[1],
                Search::default().floor,
                Search::default().highest
            )));
        }
        let script = options.script.as_deref().map(Script::from_graph).transpose()?;
        let search = Search::default();
        Ok(Question {
            session: &self.session,
            recorded: self.recorded.as_ref(),
            asked: self.asked.as_ref(),
            swapped,
            intents: self.intents.clone(),
            script,
            gain,
            grips: options.grips.clone(),
            search,
        })
    }

    /// The gain of most of the recording.
    fn own_gain(&self) -> Gain {
        let median = |column: &[f64]| {
            let mut values: Vec<f64> = column.iter().copied().filter(|x| x.is_finite()).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        };
        let graph = self.recorded.as_ref().map(|g| (g.gains.mu, g.gains.lambda));
        let mu = median(&self.session.mu).or(graph.map(|g| g.0)).unwrap_or(1.0);
        let lambda = median(&self.session.lambda).or(graph.map(|g| g.1)).unwrap_or(1.0);
        Gain { mu: if mu == 0.0 { 1.0 } else { mu }, lambda }
    }
}

/// What of a folder to name.
fn which_bag(folder: &std::path::Path) -> String {
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
