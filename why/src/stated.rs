//! What a graph itself states that may be too much for its loop.

use crate::cause_kind::CauseKind;
use crate::change::Change;
use crate::happening::Happening;
use crate::trial::Trial;
use backdrive_diagnosis::hypothesis::Family;
use backdrive_diagnosis::physics::physics_named;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};
use backdrive_plant::model::Model;

/// A thing without which the loop is re-simulated.
pub struct Suspect {
    /// What it would be as a cause.
    pub kind: CauseKind,
    /// Where.
    pub place: String,
    /// What speaks for it.
    pub evidence: String,
    /// Whether it was seen in the recording.
    pub seen: bool,
    /// The loop without it.
    pub without: Trial,
    /// What would put it right.
    pub repairs: Vec<Change>,
}

/// What the graph itself states that may be too much for it.
pub fn of_the_graph(stated: &Graph, was: &Trial, happening: &Happening) -> Vec<Suspect> {
    let mut all = Vec::new();
    let graph = &was.graph;
    let mut add = |kind, place: String, evidence: String, changes: Vec<Change>| {
        let mut without = was.clone();
        changes.iter().for_each(|c| c.apply(&mut without));
        all.push(Suspect { kind, place, evidence, seen: false, without, repairs: changes });
    };
    let late: Vec<String> = stated
        .connections
        .iter()
        .filter(|c| c.delay > 1 || c.impairment.is_some_and(|i| i.delay_s > 0.0 || i.jitter_s > 0.0 || i.loss > 0.0))
        .map(|c| format!("{}.{}", stated.nodes[c.to.0].name, c.to.1))
        .collect();
    if !late.is_empty() {
        let ways = late.join(", ");
        add(
            CauseKind::Delay,
            ways.clone(),
            format!("the graph states delay, jitter or loss on the connection to {ways}"),
            vec![Change::Delays { factor: 0.0 }],
        );
    }
    let hz = graph.timing.rate_hz;
    if hz < LOW_RATE_HZ {
        add(
            CauseKind::Rate,
            "rate".to_string(),
            format!("the loop runs at {hz:.0} Hz: one step is {:.1} ms", 1e3 / hz),
            vec![Change::Rate { hz: 10.0 * hz }],
        );
    }
    let files = |graph: &Graph, kind: NodeKind| -> Option<(DeviceFiles, f64)> {
        match graph.node_of(kind).map(|n| &n.settings) {
            Some(Settings::Master(files)) => Some((files.clone(), 0.0)),
            Some(Settings::Canceller(files, hz, _)) => Some((files.clone(), *hz)),
            _ => None,
        }
    };
    if let (Some((master, _)), Some((canceller, hz))) = (files(stated, NodeKind::Master), files(stated, NodeKind::Canceller))
        && let (Some(real), Some(model)) = (&master.model, &canceller.model)
    {
        if let (Some(grip), Some(assumed)) = (&master.fragment, &canceller.fragment)
            && grip.network.elements != assumed.network.elements
        {
            let right = Change::Canceller {
                of: format!("the grip {}, which the master has", grip.network.name),
                model: Some(Box::new(model.clone())),
                grip: Some(Box::new(grip.clone())),
                high_pass_hz: hz,
            };
            let text = format!("the canceller assumes the grip {}, and the master has {}", assumed.network.name, grip.network.name);
            add(CauseKind::Grip, "canceller".to_string(), text, vec![right]);
        }
        if real.elements != model.elements || real.bodies != model.bodies {
            let kind = left_out(real, model);
            let right = Change::Canceller {
                of: format!("the master's own model, {}", real.name),
                model: Some(Box::new(real.clone())),
                grip: canceller.fragment.clone().map(Box::new),
                high_pass_hz: hz,
            };
            let text = format!("the canceller predicts with {}, and the master is {}", model.name, real.name);
            add(kind, "canceller".to_string(), text, vec![right]);
        }
        if hz > 0.0 {
            let text = format!("the canceller's estimate is high-pass filtered at {hz:.1} Hz");
            add(CauseKind::FilterLag, "canceller".to_string(), text, vec![Change::HighPass { hz: 0.0 }]);
        }
    }
    let coarse = |node: &backdrive_nodes::graph::Node| match &node.settings {
        Settings::Master(files) if files.real_sensors => {
            files.model.as_ref().is_some_and(|m| m.outputs.iter().any(|o| o.resolution > 0.0 || o.noise > 0.0))
        }
        _ => false,
    };
    if stated.nodes.iter().any(coarse) {
        add(
            CauseKind::CoarseSensor,
            "master".to_string(),
            "the model states a resolution or noise of the position sensor".to_string(),
            vec![Change::FinerSensors],
        );
    }
    if matches!(happening, Happening::Saturation { .. }) {
        add(CauseKind::Saturation, "master".to_string(), "a limit of force or rate acts".to_string(), vec![Change::StrongerMotor]);
    }
    all
}

/// A loop slower than this has its rate among the suspects, Hz.
const LOW_RATE_HZ: f64 = 2000.0;

/// Which effect one model has that another leaves out; of several the one that is worst for a prediction.
fn left_out(real: &Model, model: &Model) -> CauseKind {
    let known: Vec<&str> = model.elements.iter().map(|e| e.law.kind().name).collect();
    let more = real.elements.iter().map(|e| e.law.kind().name).filter(|k| !known.contains(k));
    let families: Vec<Family> = more.filter_map(|kind| physics_named(kind).map(|p| p.family)).collect();
    let has = |family: Family| families.contains(&family);
    if has(Family::Contact) {
        CauseKind::Backlash
    } else if has(Family::Hysteresis) {
        CauseKind::Hysteresis
    } else if has(Family::Friction) {
        CauseKind::DryFriction
    } else if real.bodies.len() > model.bodies.len() {
        CauseKind::Compliance
    } else if real.bodies != model.bodies {
        CauseKind::Inertia
    } else {
        CauseKind::OtherPhysics
    }
}
