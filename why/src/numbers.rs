//! Whether one wrong parameter makes a master do what was recorded: a firmer or softer hand, more or less mass. Tried before any effect, because one
//! parameter that explains everything is the simplest answer.

use crate::device::{DeviceFound, NumberFound};
use backdrive_nodes::graph::{DeviceFiles, Graph, Settings};
use backdrive_plant::elements::Law;
use backdrive_stability::by_itself::alone::alone;
use backdrive_stability::by_itself::compared::{Sensor, compare};
use backdrive_stability::by_itself::recorded::{Quantity, Recorded};
use backdrive_stability::resimulate::grip;

/// A number explains a difference where it leaves no more of it than this.
const EXPLAINS: f64 = 0.1;

/// Factors that are tried, from the first to the second.
const RANGE: [f64; 2] = [0.25, 6.0];

/// Points of the first grid, and steps of the section after it.
const POINTS: usize = 13;
const SECTIONS: usize = 9;

/// What is multiplied by a factor.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Number {
    /// Every force of the grip.
    Grip,
    /// Springs of the grip, then its dampers.
    Springs,
    Dampers,
    /// Every mass of the device.
    Masses,
    /// The mass that the hand holds.
    HeldMass,
}

impl Number {
    fn multiply(self, files: &mut DeviceFiles, factor: f64) {
        match self {
            Number::Grip => files.fragment.iter_mut().for_each(|f| grip::scale(f, factor)),
            Number::Springs | Number::Dampers => {
                let elements = files.fragment.iter_mut().flat_map(|f| f.network.elements.iter_mut());
                let wanted = |law: &Law| matches!((self, law), (Number::Springs, Law::Spring(_)) | (Number::Dampers, Law::Damper(_)));
                elements.filter(|e| wanted(&e.law)).for_each(|e| e.law = e.law.scaled(factor));
            }
            Number::Masses => files.model.iter_mut().flat_map(|m| m.bodies.iter_mut()).for_each(|b| b.inertia *= factor),
            Number::HeldMass => {
                let Some(model) = &mut files.model else { return };
                let users: Vec<usize> = model.axes.iter().map(|a| a.user).collect();
                for user in users {
                    if let Some(body) = model.bodies.get_mut(user) {
                        body.inertia *= factor;
                    }
                }
            }
        }
    }

    fn found(self, files: &DeviceFiles, factor: f64) -> NumberFound {
        let grip = files.fragment.as_ref().map_or("the grip", |f| f.network.name.as_str());
        let model = files.model.as_ref();
        let held = model.and_then(|m| m.axes.first().and_then(|a| m.bodies.get(a.user)));
        let (path, declared, of_grip) = match self {
            Number::Grip => (format!("the grip {grip}: its stiffness and damping"), 1.0, true),
            Number::Springs => (format!("the stiffness of the grip {grip}"), 1.0, true),
            Number::Dampers => (format!("the damping of the grip {grip}"), 1.0, true),
            Number::Masses => ("bodies.*".to_string(), 1.0, false),
            Number::HeldMass => (format!("bodies.{}", held.map_or("", |b| b.name.as_str())), held.map_or(1.0, |b| b.inertia), false),
        };
        NumberFound { path, declared, found: declared * factor, of_grip }
    }
}

/// Searches for one parameter, or two of the grip, with which the master `node` does what was recorded, and returns the remaining share; `share` is
/// the difference without a change.
pub fn wrong_number(graph: &Graph, node: &str, axis: usize, recorded: &Recorded, share: f64) -> Option<(DeviceFound, f64)> {
    let index = graph.nodes.iter().position(|n| n.name == node)?;
    let Settings::Master(files) = &graph.nodes[index].settings else { return None };
    let topic = graph.topic_of(index, "measured").name;
    let column = recorded.track(&topic)?.column(Quantity::Position, axis);
    let left = |changes: &[(Number, f64)]| -> f64 {
        let mut changed = graph.clone();
        if let Some(Settings::Master(files)) = changed.nodes.get_mut(index).map(|n| &mut n.settings) {
            changes.iter().for_each(|(number, factor)| number.multiply(files, *factor));
        }
        let Ok(put) = alone(&changed, node, recorded) else { return f64::INFINITY };
        let Some(put) = put.iter().find(|p| p.topic == topic) else { return f64::INFINITY };
        let predicted: Vec<f64> = put.samples.iter().map(|s| Quantity::Position.of(s, axis)).collect();
        compare(column, &predicted, &Sensor::default(), graph.period_s()).map_or(f64::INFINITY, |c| c.share)
    };
    let enough = (EXPLAINS * share).max(0.5 * backdrive_stability::by_itself::compared::SMALL).min(0.5 * share);
    let numbers: &[Number] =
        if files.fragment.is_some() { &[Number::Grip, Number::Masses, Number::HeldMass] } else { &[Number::Masses, Number::HeldMass] };
    for number in numbers {
        let (factor, rest) = best(&|factor| left(&[(*number, factor)]));
        if rest <= enough {
            return Some((said(files, &[(*number, factor)]), rest));
        }
    }
    if files.fragment.is_some() {
        let (mut stiffer, mut damped) = (1.0, 1.0);
        for _ in 0..2 {
            stiffer = best(&|factor| left(&[(Number::Springs, factor), (Number::Dampers, damped)])).0;
            damped = best(&|factor| left(&[(Number::Springs, stiffer), (Number::Dampers, factor)])).0;
        }
        let both = [(Number::Springs, stiffer), (Number::Dampers, damped)];
        let rest = left(&both);
        if rest <= enough {
            return Some((said(files, &both), rest));
        }
    }
    None
}

fn said(files: &DeviceFiles, changes: &[(Number, f64)]) -> DeviceFound {
    let mut changed = files.clone();
    changes.iter().for_each(|(number, factor)| number.multiply(&mut changed, *factor));
    DeviceFound {
        word: "parameters".to_string(),
        sentence: "no effect is missing: with other parameters the model reproduces the recording".to_string(),
        physics: Vec::new(),
        numbers: changes.iter().map(|(number, factor)| number.found(files, *factor)).collect(),
        files: Some(Box::new(changed)),
    }
}

/// The factor with the least value: a grid, then golden sections.
fn best(value: &dyn Fn(f64) -> f64) -> (f64, f64) {
    let span = (RANGE[1] / RANGE[0]).ln();
    let at = |i: f64| RANGE[0] * (span * i / (POINTS - 1) as f64).exp();
    let grid: Vec<f64> = (0..POINTS).map(|i| value(at(i as f64))).collect();
    let first = (0..POINTS).min_by(|a, b| grid[*a].total_cmp(&grid[*b])).unwrap_or(0);
    let (mut low, mut high) = (at(first as f64 - 1.0).ln(), at(first as f64 + 1.0).ln());
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
    let (mut at_a, mut at_b) = (value(a.exp()), value(b.exp()));
    for _ in 0..SECTIONS {
        if at_a < at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - golden * (high - low);
            at_a = value(a.exp());
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + golden * (high - low);
            at_b = value(b.exp());
        }
    }
    if at_a < at_b { (a.exp(), at_a) } else { (b.exp(), at_b) }
}
