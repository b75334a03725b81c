//! The recorded loop: the graph of a bag with the differences that were found.

use crate::difference::{Difference, delay};
use crate::faulty::{Distortion, Side};
use crate::trial::Trial;
use backdrive_nodes::graph::{Direction, Graph, Settings};
use backdrive_stability::by_itself::compared::AsIf;
use backdrive_stability::by_itself::shapes::{Filter, Renewal};

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

/// Puts a difference into a loop.
pub fn put(trial: &mut Trial, difference: &Difference) {
    if difference.way.is_some() {
        let Some(node) = trial.graph.nodes.iter().position(|n| n.name == difference.node) else { return };
        delay(&mut trial.graph, node, difference);
        let none = of(difference);
        match difference.compared.as_if {
            AsIf::Changed { gain, .. } if gain != 1.0 => trial.distortions.push(Distortion { gain, ..none }),
            AsIf::Held { .. } | AsIf::Filtered { .. } => trial.distortions.extend(into(difference).map(|into| shaped(difference, into))),
            _ => {}
        }
        return;
    }
    if let Some(found) = difference.device.as_ref().and_then(|d| d.files.as_ref()) {
        for node in trial.graph.nodes.iter_mut().filter(|n| n.name == difference.node) {
            match &mut node.settings {
                Settings::Master(files) | Settings::Slave(files) => *files = (**found).clone(),
                _ => {}
            }
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
        AsIf::Held { .. } | AsIf::Filtered { .. } => shaped(difference, none),
        AsIf::Same | AsIf::Unsteady { .. } | AsIf::Otherwise => return,
    };
    trial.distortions.push(one);
}

/// With the rate or the low-pass that was found.
fn shaped(difference: &Difference, none: Distortion) -> Distortion {
    match difference.compared.as_if {
        AsIf::Held { rows, phase } => Distortion { hold: Some(Renewal { rows, phase }), ..none },
        AsIf::Filtered { order, corner_hz } => Distortion { filter: Some(Filter { order, corner_hz }), ..none },
        _ => none,
    }
}

/// The input at the end of a way; `None` where the node has no such port.
fn into(difference: &Difference) -> Option<Distortion> {
    let port = difference.way.as_ref()?;
    let (stage, _) = difference.kind.port(port, Direction::Input)?;
    let number = difference.kind.stages().get(stage)?.inputs.iter().position(|p| p.name == *port)?;
    Some(Distortion { stage, side: Side::Input(number), ..Distortion::none(&difference.node, difference.quantity, difference.axis) })
}

fn of(difference: &Difference) -> Distortion {
    let stage = difference.kind.port(&difference.port, Direction::Output).map_or(0, |(stage, _)| stage);
    Distortion { stage, ..Distortion::none(&difference.node, difference.quantity, difference.axis) }
}
