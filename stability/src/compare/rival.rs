//! What stands between master and slave in a comparison.

use crate::resimulate::ResimulateError;
use backdrive_control::coupling::LawKind;
use backdrive_nodes::graph::{Graph, NodeKind, Settings};

/// A rival: a law of a coupling, or plain scaling behind a canceller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rival {
    /// The law direct on the motion that a canceller leaves.
    Canceller,
    /// A law, without a canceller.
    Law(LawKind),
}

impl Rival {
    /// All of them with their words on the command line, the canceller first.
    pub fn all() -> Vec<(&'static str, Rival)> {
        std::iter::once(("canceller", Rival::Canceller)).chain(LawKind::ALL.map(|(name, law)| (name, Rival::Law(law)))).collect()
    }

    /// Its word on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Rival::Canceller => "canceller",
            Rival::Law(law) => law.name(),
        }
    }

    /// The law of the coupling.
    pub fn law(self) -> LawKind {
        match self {
            Rival::Canceller => LawKind::Direct,
            Rival::Law(law) => law,
        }
    }

    /// Puts the canceller of a graph in order: without one for the laws; for the canceller the graph's own, or one that knows the
    /// simulated master and its grip where the graph's subtracts nothing.
    ///
    /// # Errors
    /// The canceller in a graph without a canceller node, or with a master that is not simulated here.
    pub fn settle(self, graph: &mut Graph) -> Result<(), ResimulateError> {
        let path = graph.path.display().to_string();
        let master = graph.node_of(NodeKind::Master).and_then(|n| match &n.settings {
            Settings::Master(files) => Some(files.clone()),
            _ => None,
        });
        let canceller = graph.nodes.iter_mut().find_map(|n| match &mut n.settings {
            Settings::Canceller(files, ..) => Some(files),
            _ => None,
        });
        match (self, canceller) {
            (Rival::Law(_), None) => {}
            (Rival::Law(_), Some(files)) => files.model = None,
            (Rival::Canceller, None) => return Err(ResimulateError::NoLoop { graph: path, kind: NodeKind::Canceller.name() }),
            (Rival::Canceller, Some(files)) if files.model.is_some() => {}
            (Rival::Canceller, Some(files)) => {
                let Some(known) = master.filter(|m| m.model.is_some()) else {
                    return Err(ResimulateError::OwnProgram { node: "master".to_owned(), option: "--canceller" });
                };
                *files = known;
                files.real_sensors = false;
            }
        }
        Ok(())
    }
}
