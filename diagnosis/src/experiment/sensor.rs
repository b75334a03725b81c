//! Which other sensor would tell explanations apart that no excitation separates with the sensors there are.

use super::extra_output::output;
use super::rivals::Rival;
use super::setup::{Setup, Trial};
use super::types::NewSensor;
use crate::tuning::tuning;
use backdrive_plant::describe::unit_for;
use backdrive_plant::model::{InputKind, OutputKind};
use backdrive_plant::write::round_significant;

/// A sensor that a device does not have.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sensor {
    /// Such as `the position of "load"`, with how good it must be.
    pub words: String,
    /// The same for a program.
    pub new: NewSensor,
    /// Standard deviations between the rivals with it.
    pub separation: f64,
    /// Which of the trials shows it.
    pub trial: usize,
}

/// What a device could be asked beyond what it is: position and velocity of each body that moves freely, force of each element.
fn extra(setup: &Setup) -> Vec<OutputKind> {
    let model = &setup.problem.model;
    let there = |kind: &OutputKind| model.outputs.iter().zip(&setup.sensors.there).any(|(o, there)| *there && o.kind == *kind);
    let free = |b: &usize| !model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == *b);
    let bodies = (0..model.bodies.len()).filter(free).flat_map(|b| [OutputKind::Position(b), OutputKind::Velocity(b)]);
    let forces = (0..model.elements.len()).map(|e| OutputKind::Force(vec![e]));
    bodies.chain(forces).filter(|kind| !there(kind)).collect()
}

/// The sensor that separates two rivals best on one of some experiments.
pub(super) fn best(setup: &Setup, trials: &[&Trial], pair: [&Rival; 2]) -> Option<Sensor> {
    let mut wide = setup.clone();
    // Each by itself, where both rivals have what it would read.
    let kinds = extra(setup);
    let lag = setup.sensors.lag.iter().copied().max().unwrap_or(0);
    let mut found: Vec<(Sensor, Setup, usize)> = Vec::new();
    for (index, trial) in trials.iter().enumerate() {
        if index > 0 && setup.budget.is_over() {
            break;
        }
        let own = setup.outputs(&trial.record).len() * trial.record.len;
        wide.extra = kinds.clone();
        wide.extra.retain(|kind| {
            let alone = Setup { extra: vec![kind.clone()], ..setup.clone() };
            pair.iter().all(|rival| alone.reads(rival))
        });
        wide.sensors = setup.sensors.clone();
        for kind in &wide.extra {
            wide.sensors.noise_sd.push(1.0);
            wide.sensors.lag.push(if matches!(kind, OutputKind::Position(_)) { lag } else { 0 });
        }
        let Some(first) = pair[0].prediction(&wide, trial) else { continue };
        for (column, (at, kind)) in first[own..].chunks_exact(trial.record.len).zip(wide.extra.iter().enumerate()) {
            let rms = (column.iter().map(|y| y * y).sum::<f64>() / column.len() as f64).sqrt();
            let at = setup.sensors.noise_sd.len() + at;
            wide.sensors.noise_sd[at] = like(setup, kind).unwrap_or(tuning().experiment.sensor_noise * rms).max(f64::MIN_POSITIVE);
        }
        let predictions: Option<Vec<Vec<f64>>> = pair.iter().map(|r| r.prediction(&wide, trial)).collect();
        let Some(predictions) = predictions else { continue };
        let jacobians: Vec<Vec<Vec<f64>>> = pair.iter().zip(&predictions).map(|(r, y)| r.jacobian(&wide, trial, &r.own, y)).collect();
        for (e, kind) in wide.extra.iter().enumerate() {
            let from = own + e * trial.record.len;
            let pick = |all: &[f64]| [&all[..own], &all[from..from + trial.record.len]].concat();
            let difference: Vec<f64> = pick(&predictions[1]).iter().zip(pick(&predictions[0])).map(|(b, a)| b - a).collect();
            let left = pair.iter().zip(&jacobians).map(|(rival, jacobian)| {
                let columns: Vec<Vec<f64>> = jacobian.iter().map(|c| pick(c)).collect();
                rival.unexplained(&columns, &difference)
            });
            let unit = pair[0].unit.max(pair[1].unit);
            let separation = (left.fold(f64::INFINITY, f64::min) / unit).sqrt();
            let noise_sd = wide.sensors.noise_sd[setup.sensors.noise_sd.len() + e];
            let sensor = Sensor { words: words(setup, kind, noise_sd), new: new(setup, kind, noise_sd), separation, trial: index };
            found.push((sensor, wide.clone(), from));
        }
    }
    found.sort_by(|a, b| b.0.separation.total_cmp(&a.0.separation));
    // To first order a law with a threshold does not imitate one that it contains.
    let confirmed = found.into_iter().take(tuning().experiment.finalists).filter_map(|(sensor, wide, from)| {
        let trial = trials.get(sensor.trial)?;
        let own = setup.outputs(&trial.record).len() * trial.record.len;
        let pick = |all: &[f64]| [&all[..own], &all[from..from + trial.record.len]].concat();
        let [a, b] = pair;
        let left = [(a, b), (b, a)].map(|(one, other)| one.unexplained_after_steps(&wide, trial, &other.prediction(&wide, trial)?, &pick));
        let [Some(left), Some(other)] = left else { return None };
        let separation = (left.min(other) / a.unit.max(b.unit)).sqrt().min(sensor.separation);
        Some(Sensor { separation, ..sensor })
    });
    confirmed.max_by(|a, b| a.separation.total_cmp(&b.separation))
}

impl Setup<'_> {
    /// Whether a rival's model has what the extra outputs read.
    fn reads(&self, rival: &Rival) -> bool {
        let nominal = &self.problem.model;
        rival.as_fitted(self.problem).is_some_and(|model| self.extra.iter().all(|kind| output(nominal, &model, kind).is_some()))
    }
}

/// The measuring error of a sensor of the same kind that is there.
fn like(setup: &Setup, kind: &OutputKind) -> Option<f64> {
    let same = |other: &OutputKind| std::mem::discriminant(other) == std::mem::discriminant(kind);
    let outputs = setup.problem.model.outputs.iter().zip(&setup.sensors.noise_sd).zip(&setup.sensors.there);
    outputs
        .filter(|((o, noise_sd), there)| **there && same(&o.kind) && noise_sd.is_finite())
        .map(|((_, noise_sd), _)| *noise_sd)
        .reduce(f64::min)
}

/// A sensor as an output of a model file has it.
fn new(setup: &Setup, kind: &OutputKind, noise_sd: f64) -> NewSensor {
    let model = &setup.problem.model;
    let body = |b: &usize| model.bodies.get(*b).map(|b| b.name.clone());
    let (name, of, element) = match kind {
        OutputKind::Position(b) => ("position", body(b), None),
        OutputKind::Velocity(b) => ("velocity", body(b), None),
        OutputKind::Acceleration(b) => ("acceleration", body(b), None),
        OutputKind::Reaction(b) => ("reaction", body(b), None),
        OutputKind::Force(list) => ("force", None, list.first().and_then(|e| model.elements.get(*e)).map(|e| e.name.clone())),
    };
    NewSensor { kind: name.to_string(), of, element, noise_sd: round_significant(noise_sd, 2) }
}

fn words(setup: &Setup, kind: &OutputKind, noise_sd: f64) -> String {
    let model = &setup.problem.model;
    let body = |b: &usize| model.bodies.get(*b).map_or("", |b| b.name.as_str());
    let what = match kind {
        OutputKind::Position(b) => format!("the position of \"{}\"", body(b)),
        OutputKind::Velocity(b) => format!("the velocity of \"{}\"", body(b)),
        OutputKind::Acceleration(b) => format!("the acceleration of \"{}\"", body(b)),
        OutputKind::Reaction(b) => format!("the force that moves \"{}\"", body(b)),
        OutputKind::Force(list) => {
            let names: Vec<&str> = list.iter().filter_map(|e| model.elements.get(*e)).map(|e| e.name.as_str()).collect();
            format!("the force in \"{}\"", names.join(", "))
        }
    };
    let unit = unit_for(model.motion, kind.unit());
    format!("{what} to {} {unit}", round_significant(noise_sd, 2))
}
