//! What is compared, and under which conditions.

use crate::cli;
use crate::failure::Failure;
use backdrive_bags::Reader;
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides};
use backdrive_stability::compare::{Comparison, Condition, Rival, Varied};
use backdrive_stability::resimulate::recover::recorded_intents;
use backdrive_stability::session::Session;
use backdrive_stability::summary::graph_of;

pub(super) struct Loaded {
    pub(super) comparison: Comparison,
    /// What a reader has to know. One sentence each.
    pub(super) notes: Vec<String>,
}

impl Loaded {
    pub(super) fn read(options: &cli::Compare) -> Result<Loaded, Failure> {
        let path = &options.session;
        let bag = match path.extension().is_some_and(|e| e == "mcap") {
            true => Some(Reader::open(path).map_err(Failure::input)?),
            false => None,
        };
        let load = |coupling: Option<&str>| -> Result<Graph, Failure> {
            let coupling = coupling.map(str::to_string);
            let changes = Overrides { coupling, lambda: options.lambda, ..options.parts.overrides() };
            match &bag {
                Some(reader) => Ok(graph_of(reader, &changes)?),
                None => Ok(Graph::load(path, &changes)?),
            }
        };
        let intents = bag.as_ref().map(intents).transpose()?;
        let mut notes = Vec::new();
        let mut rivals = Vec::new();
        let all = Rival::all();
        let asked = |rival: &Rival| options.laws.is_empty() || options.laws.iter().any(|word| word == rival.word());
        for rival in all.into_iter().filter(asked) {
            let mut graph = load(Some(rival.law()))?;
            let node = graph.node_of(NodeKind::Canceller).is_some();
            if rival == Rival::Canceller && !node && options.laws.is_empty() {
                notes.push("the graph has no canceller node, so the laws are compared without the canceller".to_string());
                continue;
            }
            let before = knows(&graph);
            rival.settle(&mut graph).map_err(Failure::input)?;
            match (rival, before, knows(&graph)) {
                (Rival::Canceller, false, true) => notes
                    .push("the graph's canceller subtracts nothing: here it knows the simulated master and its grip exactly".to_string()),
                (Rival::Law(0), true, false) => notes.push("the laws run without the graph's canceller".to_string()),
                _ => {}
            }
            rivals.push((rival, graph));
        }
        let comparison = Comparison { rivals, conditions: conditions(options), intents, search: Comparison::SEARCH };
        if comparison.rivals.iter().any(|(_, g)| g.gains.mu * g.gains.lambda <= 0.0) {
            return Err(Failure::input(format!(
                "{}: mu*lambda is 0, so nothing would be felt; name a force scale with --lambda",
                path.display()
            )));
        }
        Ok(Loaded { comparison, notes })
    }
}

/// Whether a graph's canceller has a model.
fn knows(graph: &Graph) -> bool {
    use backdrive_nodes::graph::Settings;
    matches!(graph.node_of(NodeKind::Canceller).map(|n| &n.settings), Some(Settings::Canceller(files, ..)) if files.model.is_some())
}

/// The hand in a bag.
fn intents(reader: &Reader) -> Result<Vec<Intent>, Failure> {
    let graph = graph_of(reader, &Overrides::default())?;
    let session = Session::from_bag(reader, &graph).map_err(Failure::input)?;
    recorded_intents(&session).ok_or_else(|| {
        Failure::input(format!("{}: the hand's motion was not recorded; compare a graph file instead", reader.path().display()))
    })
}

fn conditions(options: &cli::Compare) -> Vec<Condition> {
    let ms = |ms: f64| 1e-3 * ms;
    let at = Condition::delay(ms(options.at));
    let delays = options.delays.iter().map(|d| Condition::delay(ms(*d)));
    let jitter = options.jitter.iter().filter_map(|j| j.0);
    let jitter = jitter.map(|[mean, most]| Condition { varied: Varied::Jitter, jitter_s: ms(most), ..Condition::delay(ms(mean)) });
    let loss = options.loss.iter().filter_map(|l| l.0).map(|loss| Condition { varied: Varied::Loss, loss, ..at.clone() });
    let grips = options.grips.iter().filter(|g| **g != 1.0).map(|g| Condition { varied: Varied::Grip, grip_scale: *g, ..at.clone() });
    delays.chain(jitter).chain(loss).chain(grips).collect()
}
