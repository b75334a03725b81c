//! What a master does that its model does not: a diagnosis of the recorded loop, with the force on the motor and the hand as what was put in.

use crate::recorded::{Quantity, Recorded};
use backdrive_diagnosis::diagnose::diagnose;
use backdrive_diagnosis::hypothesis::{Family, Place};
use backdrive_diagnosis::problem::{Problem, Record};
use backdrive_diagnosis::search::Settings;
use backdrive_diagnosis::verdict::Parameter;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings as NodeSettings};
use backdrive_plant::model::Model;
use backdrive_plant::recording::{Jitter, Recording};
use backdrive_plant::set::Initial;
use serde::Serialize;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Of what a diagnosis computes by default: a bag is to be answered within half a minute, and there is one record.
const EFFORT: f64 = 0.3;

/// Rows that are looked at, up to this time after the first touch, s: what shakes then shows all it can show within it.
const ROWS: usize = 10_000;
const AFTER_TOUCH_S: f64 = 0.4;

/// What was found of a device.
#[derive(Debug, Clone, Serialize)]
pub struct DeviceFound {
    /// The diagnosis' word, such as `missing`.
    pub word: String,
    /// And its sentence.
    pub sentence: String,
    /// Physics that the model leaves out, most important first.
    pub physics: Vec<PhysicsFound>,
    /// Numbers of the model that are others: path, as the model has it, as it is.
    pub numbers: Vec<NumberFound>,
    /// The device with all that.
    #[serde(skip)]
    pub files: Option<Box<DeviceFiles>>,
}

/// A physics at a place.
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
    /// Its most telling number, with unit.
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
    /// As it is.
    pub found: f64,
    /// Whether it belongs to the hand's grip.
    pub of_grip: bool,
}

/// Diagnoses the master of a graph by its bag. `None` where the bag cannot say: the hand was not recorded, or there is no model.
pub fn diagnose_master(graph: &Graph, recorded: &Recorded, patience: Duration, stop: &AtomicBool) -> Option<DeviceFound> {
    let master = graph.nodes.iter().position(|n| n.kind == NodeKind::Master)?;
    let NodeSettings::Master(DeviceFiles { model: Some(model), fragment, substeps, real_sensors }) = &graph.nodes[master].settings else {
        return None;
    };
    let (held, hands) = match fragment {
        Some(grip) => model.held_by(grip),
        None => (model.clone(), model.own_hands()),
    };
    let topic = |port: &str| graph.topic_of(master, port).name;
    let measured = recorded.track(&topic("measured"))?;
    let wanted = graph.connections.iter().find(|c| c.to.0 == master && c.to.1 == "intent").map(|c| c.topic.name.clone());
    let intent = wanted.and_then(|t| recorded.track(&t));
    let slave =
        graph.nodes.iter().position(|n| n.kind == NodeKind::Slave).and_then(|i| recorded.track(&graph.topic_of(i, "measured").name));
    let touch = slave.and_then(|t| t.effort.iter().filter_map(|c| c.iter().position(|f| f.is_finite() && *f != 0.0)).min());
    let enough = touch.map_or(ROWS, |row| row + (AFTER_TOUCH_S / graph.period_s()) as usize);
    let rows = enough.min(ROWS).min(recorded.rows);
    let whole = |column: &[f64]| -> Option<Vec<f64>> {
        let mut before = column.iter().copied().find(|x| x.is_finite())?;
        Some(
            column[..rows.min(column.len())]
                .iter()
                .map(|x| {
                    before = if x.is_finite() { *x } else { before };
                    before
                })
                .collect(),
        )
    };
    let mut signals = Vec::new();
    for (index, axis) in held.axes.iter().enumerate() {
        let input = held.inputs.get(axis.feedback)?;
        signals.push((input.name.clone(), whole(measured.column(Quantity::Effort, index))?));
        let output = held.outputs.get(axis.measured)?;
        let position = whole(measured.column(Quantity::Position, index))?;
        signals.push((output.name.clone(), position.iter().map(|x| x / axis.scale).collect()));
        if let Some((_, hand)) = hands.iter().find(|(number, _)| *number == index) {
            let hand = held.inputs.get(*hand)?;
            signals.push((hand.name.clone(), whole(intent?.column(Quantity::Position, index))?));
        }
    }
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
    let model = Model::from_toml(&text, "the master with its grip").ok()?;
    let record = Record::new(&recording, &model, Vec::new()).ok()?;
    let problem = Problem::new(text, "master.toml".into(), model, vec![record], Vec::new(), Initial::Rest).ok()?;
    let settings = Settings { effects: 2, effort: EFFORT, patience, ..Settings::default() };
    let found = diagnose(problem, &settings, Some(stop), &|_| {}).ok()?;
    let verdict = &found.verdict;
    // The nearest explanation is told with its confidence, also where a diagnosis does not claim it.
    let physics = verdict.findings.iter().map(|f| PhysicsFound {
        physics: f.physics.clone(),
        place: match &f.place {
            Place::Between(a, b) => format!("{a} and {b}"),
            Place::Signal(name) => name.clone(),
        },
        family: f.family,
        confidence: f.family_confidence.max(f.confidence),
        size: f.parameters.iter().find_map(|(name, p)| match p {
            Parameter::One(e) => Some((name.clone(), e.value, e.unit.clone())),
            Parameter::List(_) => None,
        }),
        of_signal: matches!(f.place, Place::Signal(_)),
    });
    let physics: Vec<PhysicsFound> = physics.collect();
    let grip = fragment.as_ref().map(|g| format!("{}", g.network.name));
    let of_grip = |path: &str| grip.as_ref().is_some_and(|g| path.contains(&format!(".{g}.")));
    let numbers = verdict.parameters.iter().map(|(path, moved)| NumberFound {
        path: path.clone(),
        declared: moved.nominal,
        found: moved.value,
        of_grip: of_grip(path),
    });
    Some(DeviceFound {
        word: verdict.word.name().to_string(),
        sentence: verdict.sentence.clone(),
        numbers: numbers.filter(|n| (n.found - n.declared).abs() > 0.03 * n.declared.abs()).collect(),
        physics,
        files: Model::from_toml(&found.files.model, "the master as it was").ok().map(|model| {
            // It holds the hand.
            Box::new(DeviceFiles { model: Some(model), fragment: None, substeps: *substeps, real_sensors: *real_sensors })
        }),
    })
}
