//! The master of a graph.

use backdrive_nodes::graph::{Graph, NodeKind, Settings};
use backdrive_plant::model::Model;

pub(super) fn master_model(graph: &Graph) -> Option<(&Model, Option<&backdrive_plant::model::Fragment>)> {
    match &graph.node_of(NodeKind::Master)?.settings {
        Settings::Master(files) => files.model.as_ref().map(|model| (model, files.fragment.as_ref())),
        _ => None,
    }
}
