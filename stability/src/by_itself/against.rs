//! What was recorded of a graph that its nodes, each by itself on what it was given, do not make.
//!
//! Our own nodes (canceller, scaling, coupling) compute: what they put out follows from what they were given, so that a recording in which it does not
//! contradicts itself, or is not of this graph. Devices are models: where one does something else, the model is wrong, which is no contradiction.

use super::alone::{PutOut, alone, alone_at};
use super::compared::{AsIf, Compared, Sensor, compare};
use super::recorded::{Quantity, Recorded};
use crate::part_check::PartCheck;
use backdrive_bags::{BagError, Reader};
use backdrive_msgs::Gains;
use backdrive_nodes::graph::{Graph, Node, NodeKind, Settings};
use backdrive_nodes::stage::Clock;

/// What was found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Against {
    /// Contradictions: topic, factor and time, a sentence each.
    pub contradictions: Vec<String>,
    /// Devices beside their models, where the rows in contact do not tell.
    pub parts: Vec<PartCheck>,
    /// What was recorded and not looked at, and why.
    pub notes: Vec<String>,
}

/// Steps that are looked at, the first of a bag: memory for every sample of it is needed.
const MOST_STEPS: u64 = 40_000;

/// Outputs that follow from inputs, by kind of node: port, quantity, whether each value is one that was given.
const COMPUTED: &[(NodeKind, &str, Quantity, bool)] = &[
    (NodeKind::Canceller, "motion", Quantity::Position, true),
    (NodeKind::Canceller, "induced", Quantity::Position, false),
    (NodeKind::Scaling, "command", Quantity::Position, true),
    (NodeKind::Scaling, "force", Quantity::Effort, true),
    (NodeKind::Coupling, "command", Quantity::Position, false),
    (NodeKind::Coupling, "force", Quantity::Effort, false),
];

/// The same of devices: the name of the part.
const DEVICES: &[(NodeKind, &str, Quantity, &str)] = &[
    (NodeKind::Master, "measured", Quantity::Effort, "master's motor"),
    (NodeKind::Master, "user", Quantity::Position, "handle's motion"),
    (NodeKind::Slave, "measured", Quantity::Position, "slave's motion"),
];

/// In real time the samples of a step do not always come in it: a difference below this share is no contradiction.
const SMALL_IN_REALTIME: f64 = 0.1;
/// There, nor is one that nothing simple explains below this share.
const UNEXPLAINED_IN_REALTIME: f64 = 0.5;
/// In lockstep nothing is left to chance.
const SMALL_IN_LOCKSTEP: f64 = 0.01;

/// Holds a recording against its graph.
///
/// # Errors
/// The bag cannot be read.
pub fn against(reader: &Reader, graph: &Graph) -> Result<Against, BagError> {
    let mut found = Against::default();
    let recorded = Recorded::read_up_to(reader, MOST_STEPS)?;
    if reader.counts().iter().any(|count| *count > MOST_STEPS) {
        let seconds = MOST_STEPS as f64 * graph.period_s();
        found.notes.push(format!(
            "what the nodes make of their inputs was held against the first {seconds:.0} s of the recording, and not against the rest"
        ));
    }
    let mut looked_at: Vec<String> = Vec::new();
    for (index, node) in graph.nodes.iter().enumerate() {
        let computed =
            COMPUTED.iter().filter(|told| told.0 == node.kind).map(|(_, port, quantity, exact)| (*port, *quantity, *exact, None));
        let devices =
            DEVICES.iter().filter(|told| told.0 == node.kind).map(|(_, port, quantity, part)| (*port, *quantity, false, Some(*part)));
        let told: Vec<Told> = computed.chain(devices).collect();
        if told.is_empty() || !is_ours(node) {
            continue;
        }
        let put = match alone(graph, &node.name, &recorded) {
            Ok(put) => put,
            Err(error) => {
                found.notes.push(format!("{}: what it makes of its inputs was not looked at: {error}", node.name));
                continue;
            }
        };
        let look = Look { graph, index, recorded: &recorded };
        let mut of_node = look.at(&told, &put);
        // Somebody may have set other gains than the graph plans while it ran: those in force were recorded.
        if !of_node.contradictions.is_empty()
            && let Some(gains) = gains_of(&recorded, node)
            && let Ok(put) = alone_at(graph, &node.name, &recorded, &gains)
        {
            let again = look.at(&told, &put);
            if again.contradictions.is_empty() {
                of_node = again;
            }
        }
        looked_at.append(&mut of_node.looked_at);
        found.contradictions.append(&mut of_node.contradictions);
        found.parts.append(&mut of_node.parts);
        found.notes.append(&mut of_node.notes);
    }
    found.notes.extend(not_looked_at(reader, graph, &looked_at));
    Ok(found)
}

/// An output that is looked at: port, quantity, whether each value is one that was given, and the part where it is a device.
type Told = (&'static str, Quantity, bool, Option<&'static str>);

/// A node that is looked at.
struct Look<'a> {
    graph: &'a Graph,
    index: usize,
    recorded: &'a Recorded,
}

/// What was found of it.
#[derive(Default)]
struct Found {
    contradictions: Vec<String>,
    parts: Vec<PartCheck>,
    notes: Vec<String>,
    looked_at: Vec<String>,
}

impl Look<'_> {
    /// Holds what was recorded of the node against what it put out by itself.
    fn at(&self, told: &[Told], put: &[PutOut]) -> Found {
        let Look { graph, index, recorded } = *self;
        let node = &graph.nodes[index];
        let mut found = Found::default();
        let lockstep = graph.timing.clock == Clock::Lockstep;
        let small = if lockstep { SMALL_IN_LOCKSTEP } else { SMALL_IN_REALTIME };
        for (port, quantity, exact, part) in told {
            let topic = graph.topic_of(index, port).name;
            let Some(predicted) = put.iter().find(|put| put.topic == topic) else { continue };
            let Some(track) = recorded.track(&topic) else {
                found.notes.push(format!("{topic} was not recorded, so what {} makes of its inputs was not looked at", node.name));
                continue;
            };
            found.looked_at.push(topic.clone());
            for axis in 0..node.axes {
                let predicted: Vec<f64> = predicted.samples.iter().map(|sample| quantity.of(sample, axis)).collect();
                let column = track.column(*quantity, axis);
                match part {
                    Some(part) => found.parts.extend(device(part, axis, *quantity, column, &predicted, small)),
                    None => {
                        let sensor = Sensor { exact: *exact && !lockstep, small, ..Sensor::default() };
                        let place = Place { topic: &topic, node, axis, quantity: *quantity, period_s: graph.period_s() };
                        found.contradictions.extend(contradiction(&place, graph, column, &predicted, &sensor));
                    }
                }
            }
        }
        found
    }
}

/// Whether it is a node whose inside is known: no program of its own, and no device without a model.
fn is_ours(node: &Node) -> bool {
    node.command.is_none()
        && match &node.settings {
            Settings::Master(files) | Settings::Slave(files) => files.model.is_some(),
            _ => true,
        }
}

/// Gains that a node had in force, as it told them.
fn gains_of(recorded: &Recorded, node: &Node) -> Option<Vec<Gains>> {
    let topic = format!("/{}/gains", node.name);
    let mut gains: Vec<Gains> = recorded.gains.iter().filter(|(of, _)| *of == topic).map(|(_, gains)| *gains).collect();
    gains.sort_by_key(|gains| gains.step);
    (!gains.is_empty()).then_some(gains)
}

/// Where in a bag something was compared.
struct Place<'a> {
    topic: &'a str,
    node: &'a Node,
    axis: usize,
    quantity: Quantity,
    period_s: f64,
}

/// The sentence of a contradiction; `None` where there is none.
fn contradiction(place: &Place, graph: &Graph, recorded: &[f64], predicted: &[f64], sensor: &Sensor) -> Option<String> {
    let absent = || {
        let due = predicted.iter().filter(|x| x.is_finite() && **x != 0.0).count();
        let there = recorded.iter().filter(|x| x.is_finite()).count();
        (due >= 64 && there * 50 < due)
            .then(|| format!("{} says nothing in {due} steps in which {} puts something out", place.topic, place.node.name))
    };
    let Some(compared) = compare(recorded, predicted, sensor, place.period_s) else { return absent() };
    let bridged = (graph.stale_after_s / place.period_s) as usize;
    let is_realtime = graph.timing.clock == Clock::Realtime;
    let fine = match compared.as_if {
        AsIf::Same => true,
        AsIf::Unsteady { late, jitter, missing } => is_realtime && late + jitter <= bridged && missing < SMALL_IN_REALTIME,
        AsIf::Changed { gain, late } => is_realtime && late <= bridged && (gain - 1.0).abs() < SMALL_IN_REALTIME,
        AsIf::Dead { .. } => false,
        AsIf::Railed { .. } | AsIf::Stepped { .. } | AsIf::Noisy { .. } | AsIf::Otherwise => {
            is_realtime && compared.share < UNEXPLAINED_IN_REALTIME
        }
    };
    (!fine).then(|| sentence(place, &compared, recorded, predicted))
}

fn sentence(place: &Place, compared: &Compared, recorded: &[f64], predicted: &[f64]) -> String {
    let size = predicted.iter().filter(|x| x.is_finite()).fold(0.0_f64, |m, x| m.max(x.abs()));
    let differs = |row: &usize| {
        let (is, due) = (recorded[*row], predicted[*row]);
        due.is_finite() && (is.is_nan() || (is - due).abs() > 1e-3 * size)
    };
    let rows: Vec<usize> = (0..recorded.len().min(predicted.len())).filter(differs).collect();
    let (first, last) = (rows.first().copied().unwrap_or(0), rows.last().copied().unwrap_or(0));
    // The factor where they differ: elsewhere it is 1.
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for row in rows.iter().filter(|row| recorded[**row].is_finite()) {
        xx += predicted[*row] * predicted[*row];
        xy += predicted[*row] * recorded[*row];
        yy += recorded[*row] * recorded[*row];
    }
    let gain = if xx > 0.0 { xy / xx } else { f64::NAN };
    let is_factor = gain.is_finite() && (yy - gain * xy).max(0.0).sqrt() <= 0.1 * yy.sqrt() && gain != 0.0;
    let how = match compared.as_if {
        AsIf::Changed { gain, late } if late > 0 && (gain - 1.0).abs() < 0.02 => {
            format!("{:.1} ms late", 1e3 * late as f64 * place.period_s)
        }
        AsIf::Changed { gain, late } if late > 0 => format!("{gain:.4} times, and {:.1} ms late,", 1e3 * late as f64 * place.period_s),
        AsIf::Changed { gain, .. } => format!("{gain:.4} times"),
        AsIf::Dead { .. } => "standing still, and not".to_owned(),
        AsIf::Unsteady { .. } => "unevenly late,".to_owned(),
        _ if is_factor => format!("{gain:.4} times"),
        _ => format!("{:.0} % apart from", 100.0 * compared.share),
    };
    let of = match place.quantity {
        Quantity::Position => "position",
        Quantity::Effort => "force",
    };
    let axis = place.node.axis_names.get(place.axis).filter(|_| place.node.axes > 1).map_or(String::new(), |name| format!(", axis {name}"));
    format!(
        "{} (its {of}{axis}) is {how} what {} makes of its recorded inputs, from {:.3} s to {:.3} s",
        place.topic,
        place.node.name,
        first as f64 * place.period_s,
        last as f64 * place.period_s
    )
}

/// A device beside its model.
fn device(part: &'static str, axis: usize, quantity: Quantity, recorded: &[f64], predicted: &[f64], small: f64) -> Option<PartCheck> {
    let rows: Vec<usize> =
        (0..recorded.len().min(predicted.len())).filter(|r| recorded[*r].is_finite() && predicted[*r].is_finite()).collect();
    if rows.len() < 64 {
        return None;
    }
    let rms = |value: &dyn Fn(usize) -> f64| (rows.iter().map(|row| value(*row).powi(2)).sum::<f64>() / rows.len() as f64).sqrt();
    let (error_rms, effect_rms) = (rms(&|row| recorded[row] - predicted[row]), rms(&|row| predicted[row]));
    let quantity = match quantity {
        Quantity::Position => "position",
        Quantity::Effort => "applied force",
    };
    let agrees = error_rms <= 2.0 * small * effect_rms.max(rms(&|row| recorded[row]));
    Some(PartCheck { part, axis, quantity, error_rms, effect_rms, floor_rms: 0.0, agrees })
}

/// Topics of samples in the bag that no answer is drawn from.
fn not_looked_at(reader: &Reader, graph: &Graph, looked_at: &[String]) -> Option<String> {
    let ports = graph.nodes.iter().enumerate().flat_map(|(index, node)| {
        let used: &[&str] = match node.kind {
            NodeKind::Operator => &["intent"],
            NodeKind::Master | NodeKind::Slave => &["measured"],
            NodeKind::Scaling => &["dither"],
            _ => &[],
        };
        used.iter().map(move |port| graph.topic_of(index, port).name)
    });
    let used: Vec<String> = ports.chain(looked_at.iter().cloned()).collect();
    let samples = reader
        .topics()
        .iter()
        .zip(reader.counts())
        .filter(|(topic, count)| topic.kind == Some(backdrive_msgs::topic::Kind::Sample) && **count > 0);
    let others: Vec<&str> = samples.map(|(topic, _)| topic.name.as_str()).filter(|name| !used.iter().any(|used| used == name)).collect();
    (!others.is_empty()).then(|| format!("recorded and not looked at: {}", others.join(", ")))
}
