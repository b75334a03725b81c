//! The recorded loop: the graph of a bag with the differences that were found.

use crate::difference::{Difference, delay};
use crate::faulty::Distortion;
use crate::trial::Trial;
use backdrive_nodes::graph::{Direction, Graph, NodeKind, Settings};
use backdrive_stability::by_itself::compared::AsIf;

/// Puts differences into a graph; those of which nothing simple is known stay out, and are not counted.
pub fn as_recorded(graph: &Graph, differences: &[Difference]) -> Trial {
    let mut trial = Trial::of(graph.clone());
    for difference in differences {
        put(&mut trial, difference);
    }
    trial
}

/// Whether a difference can be put into a graph.
pub fn is_modelled(difference: &Difference) -> bool {
    difference.device.as_ref().is_some_and(|d| d.files.is_some()) || !matches!(difference.compared.as_if, AsIf::Otherwise | AsIf::Same)
}

fn put(trial: &mut Trial, difference: &Difference) {
    if difference.way.is_some() {
        let Some(node) = trial.graph.nodes.iter().position(|n| n.name == difference.node) else { return };
        delay(&mut trial.graph, node, difference);
        if let AsIf::Changed { gain, .. } = difference.compared.as_if
            && gain != 1.0
        {
            trial.distortions.push(Distortion { gain, ..of(difference) });
        }
        return;
    }
    if let Some(found) = difference.device.as_ref().and_then(|d| d.files.as_ref()) {
        for node in trial.graph.nodes.iter_mut().filter(|n| n.name == difference.node && n.kind == NodeKind::Master) {
            node.settings = Settings::Master((**found).clone());
        }
        return;
    }
    let none = of(difference);
    let one = match difference.compared.as_if {
        AsIf::Changed { gain, late } => Distortion { gain, late, ..none },
        AsIf::Dead { from_row } => Distortion { dead_from: Some(from_row), ..none },
        AsIf::Railed { low, high } => Distortion { rails: [low, high], ..none },
        AsIf::Stepped { step } => Distortion { step, ..none },
        AsIf::Noisy { deviation } => Distortion { noise: deviation, ..none },
        AsIf::Same | AsIf::Unsteady { .. } | AsIf::Otherwise => return,
    };
    trial.distortions.push(one);
}

fn of(difference: &Difference) -> Distortion {
    let stage = difference.kind.port(&difference.port, Direction::Output).map_or(0, |(stage, _)| stage);
    Distortion { stage, ..Distortion::none(&difference.node, difference.quantity, difference.axis) }
}
