//! What was recorded of a graph that its nodes, each by itself on what it was given, do not make.
//!
//! Our own nodes (canceller, scaling, coupling) compute: what they put out follows from what they were given, so that a recording in which it does not
//! contradicts itself, or is not of this graph. Devices are models: where one does something else, the model is wrong, which is no contradiction.

use super::alone::{Alone, PutOut};
use super::compared::{AsIf, Compared, Sensor, compare};
use super::devices::{InWindow, Output, whole};
use super::recorded::Quantity;
use super::windows::{Window, in_windows};
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
    /// Devices beside their models, where the rows in contact do not decide.
    pub parts: Vec<PartCheck>,
    /// What was recorded and not examined, and why.
    pub notes: Vec<String>,
}

/// Steps that are examined at once: memory for every sample of them is needed.
const WINDOW: u64 = 40_000;

/// Outputs that follow from inputs, by kind of node: port, quantity, whether each value is one that was given.
const COMPUTED: &[(NodeKind, &str, Quantity, bool)] = &[
    (NodeKind::Canceller, "motion", Quantity::Position, true),
    (NodeKind::Canceller, "induced", Quantity::Position, false),
    (NodeKind::Scaling, "command", Quantity::Position, true),
    (NodeKind::Scaling, "force", Quantity::Effort, true),
    (NodeKind::Coupling, "command", Quantity::Position, false),
    (NodeKind::Coupling, "force", Quantity::Effort, false),
    (NodeKind::Coupling, "to_far", Quantity::Position, false),
    (NodeKind::Coupling, "to_far", Quantity::Effort, false),
    (NodeKind::Coupling, "to_near", Quantity::Position, false),
    (NodeKind::Coupling, "to_near", Quantity::Effort, false),
];

/// The same of devices: the name of the part.
const DEVICES: &[(NodeKind, &str, Quantity, &str)] = &[
    (NodeKind::Master, "measured", Quantity::Effort, "master's motor"),
    (NodeKind::Master, "user", Quantity::Position, "handle's motion"),
    (NodeKind::Master, "measured", Quantity::Position, "master's motion"),
    (NodeKind::Slave, "measured", Quantity::Position, "slave's motion"),
    (NodeKind::Slave, "measured", Quantity::Effort, "slave's force"),
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
    let all: Vec<usize> = (0..graph.nodes.len()).filter(|index| !told(graph, *index).is_empty()).collect();
    let mut of_nodes = look_at(reader, graph, &all, false)?;
    // Somebody may have set other gains than the graph plans while it ran: those in force were recorded.
    let contradicted: Vec<usize> =
        all.iter().zip(&of_nodes).filter(|(_, of)| !of.contradictions.is_empty()).map(|(index, _)| *index).collect();
    if !contradicted.is_empty() {
        for (index, again) in contradicted.iter().zip(look_at(reader, graph, &contradicted, true)?) {
            if let Some(of) = all.iter().position(|at| at == index).filter(|_| again.has_gains && again.contradictions.is_empty()) {
                of_nodes[of] = again;
            }
        }
    }
    let mut looked_at: Vec<String> = Vec::new();
    for mut of in of_nodes {
        looked_at.append(&mut of.looked_at);
        found.contradictions.extend(of.contradictions.iter().map(Contradiction::sentence));
        found.parts.extend(whole(&of.parts));
        found.notes.append(&mut of.notes);
    }
    found.notes.extend(not_looked_at(reader, graph, &looked_at));
    Ok(found)
}

/// The outputs of a node that are examined.
fn told(graph: &Graph, index: usize) -> Vec<Told> {
    let Some(node) = graph.nodes.get(index).filter(|node| is_ours(node)) else { return Vec::new() };
    let computed = COMPUTED.iter().filter(|told| told.0 == node.kind).map(|(_, port, quantity, exact)| (*port, *quantity, *exact, None));
    let devices = DEVICES.iter().filter(|told| told.0 == node.kind).map(|(_, port, quantity, part)| (*port, *quantity, false, Some(*part)));
    computed.chain(devices).collect()
}

/// Runs nodes by themselves along the whole recording, window by window. `recorded_gains`: with the gains that were in force instead of those that the graph
/// plans.
fn look_at(reader: &Reader, graph: &Graph, nodes: &[usize], recorded_gains: bool) -> Result<Vec<Found>, BagError> {
    let mut found: Vec<Found> = nodes.iter().map(|_| Found::default()).collect();
    let mut running: Vec<Option<Alone>> = nodes.iter().map(|_| None).collect();
    let mut begun = false;
    in_windows(reader, WINDOW, |window| {
        let nodes = nodes.iter().filter_map(|index| Some((*index, graph.nodes.get(*index)?)));
        for ((index, node), (of, running)) in nodes.zip(found.iter_mut().zip(&mut running)) {
            let told = told(graph, index);
            if !begun {
                match Alone::new(graph, &node.name, &window.recorded) {
                    Ok(alone) => *running = Some(alone),
                    Err(error) => of.notes.push(format!("{}: its response to its inputs was not checked: {error}", node.name)),
                }
            }
            let Some(alone) = running.as_mut() else { continue };
            let gains = if recorded_gains { gains_of(window, node) } else { Vec::new() };
            of.has_gains |= !gains.is_empty();
            let put = alone.run(&window.recorded, window.origin, &gains);
            Look { graph, index, window }.at(&told, &put, of);
        }
        begun = true;
    })?;
    for (index, of) in nodes.iter().zip(&mut found) {
        let Some(node) = graph.nodes.get(*index) else { continue };
        let absent: std::collections::BTreeSet<String> = of.absent.drain(..).filter(|topic| !of.looked_at.contains(topic)).collect();
        let note = |topic| format!("{topic} was not recorded, so the response of {} to its inputs was not checked", node.name);
        of.notes.extend(absent.into_iter().map(note));
    }
    Ok(found)
}

/// An output that is examined: port, quantity, whether each value is one that was given, and the part where it is a device.
type Told = (&'static str, Quantity, bool, Option<&'static str>);

/// A node that is examined in a window.
struct Look<'a> {
    graph: &'a Graph,
    index: usize,
    window: &'a Window,
}

/// What was found of it.
#[derive(Default)]
struct Found {
    contradictions: Vec<Contradiction>,
    /// Outputs of devices, in every window.
    parts: Vec<InWindow>,
    notes: Vec<String>,
    looked_at: Vec<String>,
    /// Topics without a sample in some window.
    absent: Vec<String>,
    /// Whether gains in force were recorded.
    has_gains: bool,
}

/// An output that is not what its node makes of its inputs.
struct Contradiction {
    /// Topic and quantity.
    what: String,
    topic: String,
    node: String,
    how: How,
    /// Times between which it lies, s.
    from_s: f64,
    to_s: f64,
}

enum How {
    /// No input arrives during this number of steps in which something is put out.
    Silent(usize),
    /// In words.
    Differs(String),
}

impl Contradiction {
    fn sentence(&self) -> String {
        let Contradiction { what, topic, node, from_s, to_s, .. } = self;
        match &self.how {
            How::Silent(due) => format!("{topic} has no message in {due} steps in which {node} should publish"),
            How::Differs(how) => {
                format!("{what} is {how} the response of {node} to its recorded inputs, from {from_s:.3} s to {to_s:.3} s")
            }
        }
    }
}

impl Found {
    /// What goes on from one window to the next is one contradiction.
    fn contradicts(&mut self, new: Contradiction) {
        let before = self.contradictions.iter_mut().find(|old| old.what == new.what);
        match before {
            Some(old) => {
                old.to_s = old.to_s.max(new.to_s);
                match (&mut old.how, new.how) {
                    (How::Silent(due), How::Silent(more)) => *due += more,
                    (How::Silent(_), differs) => (old.how, old.from_s) = (differs, new.from_s),
                    (How::Differs(_), _) => {}
                }
            }
            None => self.contradictions.push(new),
        }
    }
}

impl Look<'_> {
    /// Holds what was recorded of the node against what it put out by itself.
    fn at(&self, told: &[Told], put: &[PutOut], found: &mut Found) {
        let Look { graph, index, window } = *self;
        let node = &graph.nodes[index];
        let lockstep = graph.timing.clock == Clock::Lockstep;
        let small = if lockstep { SMALL_IN_LOCKSTEP } else { SMALL_IN_REALTIME };
        let first_row = (window.recorded.first - window.origin) as usize;
        for (port, quantity, exact, part) in told {
            let topic = graph.topic_of(index, port).name;
            let Some(predicted) = put.iter().find(|put| put.topic == topic) else { continue };
            let Some(track) = window.recorded.track(&topic) else {
                found.absent.push(topic);
                continue;
            };
            if !found.looked_at.contains(&topic) {
                found.looked_at.push(topic.clone());
            }
            if !lockstep && *part == Some("slave's force") && is_unsteady(graph, index) {
                continue;
            }
            for axis in 0..node.axes {
                let predicted: Vec<f64> = predicted.samples.iter().map(|sample| quantity.of(sample, axis)).collect();
                let column = track.column(*quantity, axis);
                match part {
                    Some(part) => {
                        let output = Output { part, axis, quantity: *quantity, small, lockstep };
                        let span_s = [first_row, first_row + window.recorded.rows].map(|row| row as f64 * graph.period_s());
                        found.parts.extend(InWindow::of(output, column, &predicted, span_s));
                    }
                    None => {
                        let sensor = Sensor { exact: *exact && !lockstep, small, ..Sensor::default() };
                        let place = Place { topic: &topic, node, axis, quantity: *quantity, period_s: graph.period_s(), first_row };
                        if let Some(new) = contradiction(&place, graph, column, &predicted, &sensor) {
                            found.contradicts(new);
                        }
                    }
                }
            }
        }
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

/// Whether a way to a node loses or scatters what it carries: in real time that is never the same twice, and a stiff wall makes much of it.
fn is_unsteady(graph: &Graph, index: usize) -> bool {
    let ways = graph.connections.iter().filter(|way| way.to.0 == index);
    ways.filter_map(|way| way.impairment).any(|impairment| impairment.jitter_s > 0.0 || impairment.loss > 0.0)
}

/// Gains that a node had in force, as it reported them.
fn gains_of(window: &Window, node: &Node) -> Vec<Gains> {
    let topic = format!("/{}/gains", node.name);
    let mut gains: Vec<Gains> = window.gains.iter().filter(|(of, _)| *of == topic).map(|(_, gains)| *gains).collect();
    gains.sort_by_key(|gains| gains.step);
    gains
}

/// Where in a bag something was compared.
struct Place<'a> {
    topic: &'a str,
    node: &'a Node,
    axis: usize,
    quantity: Quantity,
    period_s: f64,
    /// Row of the recording at which the window begins.
    first_row: usize,
}

/// A contradiction; `None` where there is none.
fn contradiction(place: &Place, graph: &Graph, recorded: &[f64], predicted: &[f64], sensor: &Sensor) -> Option<Contradiction> {
    let absent = || {
        let due = predicted.iter().filter(|x| x.is_finite() && **x != 0.0).count();
        let there = recorded.iter().filter(|x| x.is_finite()).count();
        (due >= 64 && there * 50 < due).then(|| place.contradicted(How::Silent(due), 0, predicted.len()))
    };
    let Some(compared) = compare(recorded, predicted, sensor, place.period_s) else { return absent() };
    let bridged = (graph.stale_after_s / place.period_s) as usize;
    let is_realtime = graph.timing.clock == Clock::Realtime;
    let fine = match compared.as_if {
        AsIf::Same => true,
        AsIf::Unsteady { late, jitter, missing } => is_realtime && late + jitter <= bridged && missing < SMALL_IN_REALTIME,
        AsIf::Changed { gain, late } => is_realtime && late <= bridged && (gain - 1.0).abs() < SMALL_IN_REALTIME,
        AsIf::Dead { .. } | AsIf::Held { .. } | AsIf::Filtered { .. } => false,
        AsIf::Railed { .. } | AsIf::Stepped { .. } | AsIf::Noisy { .. } | AsIf::Otherwise => {
            is_realtime && compared.share < UNEXPLAINED_IN_REALTIME
        }
    };
    (!fine).then(|| differs(place, &compared, recorded, predicted))
}

fn differs(place: &Place, compared: &Compared, recorded: &[f64], predicted: &[f64]) -> Contradiction {
    let size = predicted.iter().filter(|x| x.is_finite()).fold(0.0_f64, |m, x| m.max(x.abs()));
    let differs = |row: &usize| {
        let (is, due) = (recorded[*row], predicted[*row]);
        due.is_finite() && (is.is_nan() || (is - due).abs() > 1e-3 * size)
    };
    let rows: Vec<usize> = (0..recorded.len().min(predicted.len())).filter(differs).collect();
    let (first, last) = (rows.first().copied().unwrap_or(0), rows.last().copied().unwrap_or(0));
    // The factor where they differ; 1 in all other places.
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
            format!("{:.1} ms behind", 1e3 * late as f64 * place.period_s)
        }
        AsIf::Changed { gain, late } if late > 0 => format!("{gain:.4} times, and {:.1} ms behind,", 1e3 * late as f64 * place.period_s),
        AsIf::Changed { gain, .. } => format!("{gain:.4} times"),
        AsIf::Dead { .. } => "constant, unlike".to_owned(),
        AsIf::Unsteady { .. } => "irregularly delayed against".to_owned(),
        AsIf::Held { rows, .. } => format!("renewed at {:.1} Hz only, unlike", 1.0 / (rows * place.period_s)),
        AsIf::Filtered { corner_hz, .. } => format!("low-pass filtered at {corner_hz:.1} Hz, unlike"),
        _ if is_factor => format!("{gain:.4} times"),
        _ => format!("{:.0} % different from", 100.0 * compared.share),
    };
    place.contradicted(How::Differs(how), first, last)
}

impl Place<'_> {
    /// Between two rows of the window.
    fn contradicted(&self, how: How, first: usize, last: usize) -> Contradiction {
        let of = match self.quantity {
            Quantity::Position => "position",
            Quantity::Effort => "force",
        };
        let axis =
            self.node.axis_names.get(self.axis).filter(|_| self.node.axes > 1).map_or(String::new(), |name| format!(", axis {name}"));
        let at = |row: usize| (self.first_row + row) as f64 * self.period_s;
        Contradiction {
            what: format!("{} (its {of}{axis})", self.topic),
            topic: self.topic.to_owned(),
            node: self.node.name.clone(),
            how,
            from_s: at(first),
            to_s: at(last),
        }
    }
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
    (!others.is_empty()).then(|| format!("recorded, but not checked: {}", others.join(", ")))
}
