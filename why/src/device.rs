//! What a device does that its model does not: a diagnosis of the recorded loop. Of a master the force on the motor and the hand are what was put in, of a
//! slave the command and the force of what it touches.

use crate::tuned::Tuned;
use backdrive_diagnosis::hypothesis::{Family, Place};
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::output_error::candidate::{Candidate, price};
use backdrive_diagnosis::recordings::problem::{Problem, Record};
use backdrive_diagnosis::search::search;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings as NodeSettings};
use backdrive_plant::model::{Hold, Input, InputKind, Model};
use backdrive_plant::recording::{Jitter, Recording};
use backdrive_plant::set::Initial;
use backdrive_stability::by_itself::recorded::{Quantity, Recorded};
use serde::Serialize;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Of what a diagnosis computes by default: a bag is to be answered within half a minute, and there is one record.
const EFFORT: f64 = 0.2;

/// Rows that are evaluated, up to this time after the first touch, s: an oscillation is fully visible within it.
const ROWS: usize = 10_000;
const AFTER_TOUCH_S: f64 = 0.4;

/// What was found of a device.
#[derive(Debug, Clone, Serialize)]
pub struct DeviceFound {
    /// The diagnosis' word, such as `missing`.
    pub word: String,
    /// And its sentence.
    pub sentence: String,
    /// Effects that the model leaves out, most important first.
    pub physics: Vec<PhysicsFound>,
    /// Parameters of the model that differ: path, value in the model, true value.
    pub numbers: Vec<NumberFound>,
    /// Numbers of the device as a whole that explain it by themselves, each a cause of its own.
    pub tuned: Vec<Tuned>,
    /// The device with all that.
    #[serde(skip)]
    pub files: Option<Box<DeviceFiles>>,
}

/// An effect at a place.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PhysicsFound {
    /// Its name.
    pub physics: String,
    /// Where it acts.
    pub place: String,
    /// What kind it is.
    pub family: Option<Family>,
    /// How sure it is that something of the kind acts there, 0 to 1.
    pub confidence: f64,
    /// Its most informative parameter, with unit.
    pub size: Option<(String, f64, String)>,
    /// Whether it acts on the way of a signal.
    pub of_signal: bool,
}

/// A number that is another.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NumberFound {
    /// Path in the model, such as `elements.normal.spring.stiffness`.
    pub path: String,
    /// In the graph's model.
    pub declared: f64,
    /// The value that was found.
    pub found: f64,
    /// Whether it belongs to the hand's grip.
    pub of_grip: bool,
}

/// What a diagnosis starts from.
struct Given {
    /// The device with what holds it.
    held: Model,
    signals: Vec<(String, Vec<f64>)>,
}

/// Diagnoses a device of a graph by its bag. `None` where the bag cannot say: an input was not recorded, or there is no model.
pub fn diagnose(graph: &Graph, node: usize, recorded: &Recorded, patience: Duration, stop: &AtomicBool) -> Option<DeviceFound> {
    let (NodeSettings::Master(devices) | NodeSettings::Slave(devices)) = &graph.nodes.get(node)?.settings else { return None };
    let DeviceFiles { model: Some(model), fragment, substeps, real_sensors, .. } = devices else { return None };
    let is_master = graph.nodes[node].kind == NodeKind::Master;
    let slave =
        graph.nodes.iter().position(|n| n.kind == NodeKind::Slave).and_then(|i| recorded.track(&graph.topic_of(i, "measured").name));
    let touch = slave.and_then(|t| t.effort.iter().filter_map(|c| c.iter().position(|f| f.is_finite() && *f != 0.0)).min());
    let enough = touch.map_or(ROWS, |row| row + (AFTER_TOUCH_S / graph.period_s()) as usize);
    let rows = enough.min(ROWS).min(recorded.rows);
    let Given { held, signals } =
        if is_master { of_master(graph, node, devices, recorded, rows)? } else { of_slave(graph, node, model, recorded, rows)? };
    let period = graph.period_s();
    let rows = signals.iter().map(|s| s.1.len()).min()?;
    let recording = Recording {
        name: "the bag".to_string(),
        t: (0..rows).map(|i| i as f64 * period).collect(),
        period,
        signals,
        jitter: Jitter::default(),
        units: Vec::new(),
    };
    let text = held.to_toml();
    let model = Model::from_toml(&text, "the device with what holds it").ok()?;
    let record = Record::new(&recording, &model, Vec::new()).ok()?;
    let problem = Problem::new(text, "device.toml".into(), model, vec![record], Vec::new(), Initial::Rest).ok()?;
    let contact = |model: &mut Model| model.inputs.retain(|input| is_master || !input.name.starts_with(TOUCHED));
    let files = |mut model: Model| DeviceFiles {
        model: Some({
            contact(&mut model);
            model
        }),
        // What a slave touches is no part of its diagnosis.
        fragment: fragment.clone().filter(|_| !is_master),
        substeps: *substeps,
        real_sensors: *real_sensors,
        grip_changes: Vec::new(),
    };
    // First with the graph's parameters: one effect that explains everything beside them is the simplest answer. Then with other parameters.
    let fixed = Problem { stated: Vec::new(), ..problem.clone() };
    let mut best: Option<Explained> = None;
    for problem in [&fixed, &problem] {
        let found = explained(problem, patience, stop)?;
        let better = best.as_ref().is_none_or(|b| found.left < BETTER * b.left);
        if better {
            best = Some(found);
        }
        if best.as_ref().is_some_and(|b| b.left < ENOUGH) {
            break;
        }
    }
    let best = best?;
    let grip = fragment.as_ref().map(|g| g.network.name.clone());
    let of_grip = |path: &str| grip.as_ref().is_some_and(|g| path.contains(&format!(".{g}.")));
    let numbers = best.numbers.into_iter().map(|(path, declared, found)| NumberFound { of_grip: of_grip(&path), path, declared, found });
    let left = 100.0 * best.left;
    let sentence = match best.physics.first() {
        Some(first) => {
            format!("of the difference to the model, {} at {} leaves {left:.0} %", first.physics.replace('_', " "), first.place)
        }
        None => format!("other parameters leave {left:.0} % of the difference to the model, and no tested effect leaves less"),
    };
    Some(DeviceFound {
        word: if best.physics.is_empty() { "unexplained" } else { "missing" }.to_string(),
        sentence,
        numbers: numbers.filter(|n| (n.found - n.declared).abs() > 0.03 * n.declared.abs()).collect(),
        tuned: Vec::new(),
        physics: best.physics,
        files: best.model.map(|model| Box::new(files(model))),
    })
}

/// Name of the input that carries the force of what a slave touches, before the number of its axis.
const TOUCHED: &str = "touched_";

/// A column without gaps, each value held; `None` where there is no value.
fn whole(column: &[f64], rows: usize) -> Option<Vec<f64>> {
    let mut before = column.iter().copied().find(|x| x.is_finite())?;
    let one = |x: &f64| {
        before = if x.is_finite() { *x } else { before };
        before
    };
    Some(column[..rows.min(column.len())].iter().map(one).collect())
}

fn of_master(graph: &Graph, node: usize, files: &DeviceFiles, recorded: &Recorded, rows: usize) -> Option<Given> {
    let model = files.model.as_ref()?;
    let (held, hands) = match &files.fragment {
        Some(grip) => model.held_by(grip),
        None => (model.clone(), model.own_hands()),
    };
    let measured = recorded.track(&graph.topic_of(node, "measured").name)?;
    let wanted = graph.connections.iter().find(|c| c.to.0 == node && c.to.1 == "intent").map(|c| c.topic.name.clone());
    let intent = wanted.and_then(|t| recorded.track(&t));
    let mut signals = Vec::new();
    for (index, axis) in held.axes.iter().enumerate() {
        let input = held.inputs.get(axis.feedback)?;
        signals.push((input.name.clone(), whole(measured.column(Quantity::Effort, index), rows)?));
        let output = held.outputs.get(axis.measured)?;
        let position = whole(measured.column(Quantity::Position, index), rows)?;
        signals.push((output.name.clone(), position.iter().map(|x| x / axis.scale).collect()));
        if let Some((_, hand)) = hands.iter().find(|(number, _)| *number == index) {
            let hand = held.inputs.get(*hand)?;
            signals.push((hand.name.clone(), whole(intent?.column(Quantity::Position, index), rows)?));
        }
    }
    Some(Given { held, signals })
}

fn of_slave(graph: &Graph, node: usize, model: &Model, recorded: &Recorded, rows: usize) -> Option<Given> {
    let measured = recorded.track(&graph.topic_of(node, "measured").name)?;
    let way = graph.connections.iter().find(|c| c.to.0 == node && c.to.1 == "command")?;
    let command = recorded.track(&way.topic.name)?;
    let period = graph.period_s();
    let late = way.delay as usize + way.impairment.map_or(0, |i| (i.delay_s / period).round() as usize);
    let mut held = model.clone();
    let mut signals = Vec::new();
    for (index, axis) in model.axes.iter().enumerate() {
        let input = held.inputs.get(axis.feedback)?.name.clone();
        let sent = whole(command.column(Quantity::Position, index), rows)?;
        let first = *sent.first()?;
        let came: Vec<f64> = (0..sent.len()).map(|row| row.checked_sub(late).map_or(first, |row| sent[row])).collect();
        signals.push((input, came));
        let output = held.outputs.get(axis.measured)?.name.clone();
        let position = whole(measured.column(Quantity::Position, index), rows)?;
        signals.push((output, position.iter().map(|x| x / axis.scale).collect()));
        let touched = format!("{TOUCHED}{index}");
        let force = whole(measured.column(Quantity::Effort, index), rows)?;
        signals.push((touched.clone(), force));
        held.inputs.push(Input::ideal(&touched, InputKind::Force, axis.user, Hold::Linear));
    }
    Some(Given { held, signals })
}

/// Another explanation counts where it leaves so much less.
const BETTER: f64 = 0.7;

/// Nothing else is tried where so little is left.
const ENOUGH: f64 = 0.15;

/// More left than this is no explanation.
const NONE: f64 = 0.7;

/// The best single effect of a search.
struct Explained {
    left: f64,
    physics: Vec<PhysicsFound>,
    numbers: Vec<(String, f64, f64)>,
    model: Option<Model>,
}

fn explained(problem: &Problem, patience: Duration, stop: &AtomicBool) -> Option<Explained> {
    let options = Options { effects: Some(1), effort: Some(EFFORT), patience: Some(patience), ..Options::default() };
    let search = search(problem, &options, options.limit(Some(stop)), &|_| {}).ok()?;
    let level = |levels: &[f64]| levels.iter().map(|l| l * l).sum::<f64>().sqrt();
    let given = level(&search.levels_given).max(f64::MIN_POSITIVE);
    let correlation = search.nominal.correlation_time;
    let cost = |c: &Candidate| price(c, search.samples, correlation);
    let best = search.found.iter().chain([&search.nominal]).min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
    let left = level(&best.levels) / given;
    let family = |c: &Candidate| c.structure.added.first().map(|h| h.physics.family);
    // The additional residual of the best of another kind shows how certain the kind is.
    let rival = search
        .found
        .iter()
        .chain([&search.nominal])
        .filter(|c| family(c) != family(best))
        .map(|c| level(&c.levels))
        .fold(f64::INFINITY, f64::min);
    let confidence = (1.0 - 0.5 * (level(&best.levels) / rival).min(1.0)).clamp(0.0, 0.98);
    let place = |place: &Place| match place {
        Place::Between(a, b) => format!("{a} and {b}"),
        Place::Signal(name) => name.clone(),
    };
    let values = best.structure.added_of(&best.fit.values);
    let physics = best.structure.added.iter().zip(&values).filter(|_| left < NONE).map(|(h, values)| PhysicsFound {
        physics: h.physics.name.to_string(),
        place: place(&h.place),
        family: Some(h.physics.family),
        confidence,
        size: h.parameters.first().zip(values.first()).map(|(p, v)| (p.key.to_string(), *v, p.unit.to_string())),
        of_signal: matches!(h.place, Place::Signal(_)),
    });
    let stated = best.structure.stated_of(problem, &best.fit.values);
    let numbers = problem.stated.iter().zip(stated).map(|(s, value)| (s.path.clone(), s.given, value));
    Some(Explained { left, physics: physics.collect(), numbers: numbers.collect(), model: best.structure.model(problem, &best.fit.values) })
}
