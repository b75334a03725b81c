//! A model simulated on a recording: the readings of its sensors before rounding.

use crate::coupling::Coupling;
use crate::problem::{Logged, Record};
use crate::tuning::tuning;
use crate::work::{Budget, Steps};
use backdrive_plant::model::Model;
use backdrive_plant::set::Condition;
use backdrive_plant::stepper::{Options, Plant, Segment, ahead, segments};

/// What it takes to set a simulation up.
const SETTING_UP: Steps = 200;

/// As a number of substeps: twice as many as the model asks for.
pub const TWICE: usize = usize::MAX;

/// A motion that a record starts with: body, position in m, velocity in m/s.
pub type Start = (usize, f64, f64);

/// An input and its samples, in the place of those of a record.
pub type Curve = (usize, Vec<f64>);

/// How a model is run on a record.
#[derive(Clone, Copy)]
pub struct Conditions<'r> {
    /// Motions that bodies start with, beside those of the record.
    pub starts: &'r [Start],
    /// Inputs of its own.
    pub curves: &'r [Curve],
    /// Substeps per sample, at most; [`TWICE`] for twice as many as the model asks for.
    pub substeps: usize,
    /// Tracking (observer) coupling of the model to the measured data, and the index of the record in it.
    pub coupling: Option<(&'r Coupling, usize)>,
    /// Counts the work.
    pub budget: &'r Budget<'r>,
}

/// Predictions of a record's measured outputs, one column after the other in the order of the model, `record.len` samples each.
/// At most `substeps` per sample. `None` where the model cannot be simulated or its motion leaves all bounds.
pub fn predict(model: &Model, record: &Record, substeps: usize) -> Option<Vec<f64>> {
    predict_under(model, record, &Conditions { starts: &[], curves: &[], substeps, coupling: None, budget: &Budget::default() })
}

/// The same under other conditions.
pub fn predict_under(model: &Model, record: &Record, conditions: &Conditions) -> Option<Vec<f64>> {
    let measured: Vec<usize> = (0..model.outputs.len()).filter(|o| record.outputs.get(*o).is_some_and(Option::is_some)).collect();
    // Coupled to what was measured, or driven by a curve of its own, it runs on an even grid; else on the times at which it was logged.
    let logged = record.logged.as_deref().filter(|_| conditions.coupling.is_none() && conditions.curves.is_empty());
    let length = logged.map_or(record.len, Logged::len);
    let mut columns = vec![0.0; measured.len() * length];
    let mut values = vec![0.0; model.outputs.len()];
    run(model, record, logged, conditions, length, &mut |plant, sample| {
        plant.outputs(&mut values);
        for (column, output) in measured.iter().enumerate() {
            columns[column * length + sample] = values[*output];
        }
    })?;
    if let Some(logged) = logged {
        columns = columns.chunks_exact(length).flat_map(|column| logged.read(column)).collect();
    }
    columns.iter().all(|y| y.is_finite()).then_some(columns)
}

/// Position and velocity of each body at a sample of a record.
pub fn motion_at(model: &Model, record: &Record, conditions: &Conditions, at: usize) -> Option<Vec<Start>> {
    let mut motion = Vec::new();
    run(model, record, None, conditions, at + 1, &mut |plant, sample| {
        if sample == at {
            motion = (0..model.bodies.len()).map(|body| (body, plant.position(body), plant.velocity(body))).collect();
        }
    })?;
    motion.iter().all(|(_, x, v)| x.is_finite() && v.is_finite()).then_some(motion)
}

/// Simulates a model on the first samples of a record, or points of the grid of one that is `logged` at times of its own, and calls `show` with the plant at each.
fn run(
    model: &Model,
    record: &Record,
    logged: Option<&Logged>,
    conditions: &Conditions,
    samples: usize,
    show: &mut dyn FnMut(&mut Plant, usize),
) -> Option<()> {
    let Conditions { starts, curves, substeps, coupling, budget } = *conditions;
    let (inputs, driving, period, length) = match logged {
        Some(logged) => (&logged.inputs, &logged.segments, logged.step, logged.len()),
        None => (&record.inputs, &record.segments, record.period, record.len),
    };
    // So many substeps are meant per sample.
    let substeps = if substeps == TWICE || logged.is_none() { substeps } else { substeps.div_ceil(tuning().recordings.grid_steps) };
    let conditioned;
    let model = if record.conditions.iter().any(|(_, c)| matches!(c, Condition::Value(_))) {
        let mut changed = model.clone();
        for (path, condition) in &record.conditions {
            if let Condition::Value(value) = condition {
                changed.set_values_at(path, &[*value]).ok()?;
            }
        }
        conditioned = changed;
        &conditioned
    } else {
        model
    };
    let coupled;
    let mut moved = Vec::new();
    let model = match coupling.filter(|(g, _)| !g.is_empty()) {
        Some((coupling, index)) => {
            (coupled, moved) = coupling.attach(model, index, record.period)?;
            &coupled
        }
        None => model,
    };
    let (mut own_inputs, mut own_segments) = (Vec::new(), Vec::new());
    if !curves.is_empty() {
        (own_inputs, own_segments) = (inputs.clone(), driving.clone());
        for (input, samples) in curves {
            *own_inputs.get_mut(*input)? = samples.clone();
            *own_segments.get_mut(*input)? = segments(model.inputs.get(*input)?.hold, samples, period);
        }
    }
    let (recorded, pieces) = if curves.is_empty() { (inputs, driving) } else { (&own_inputs, &own_segments) };
    let caught_up = ahead(model, recorded, period);
    let (model, columns) = caught_up.as_ref().map_or((model, recorded), |(model, columns)| (model, columns));
    let late: Option<Vec<Vec<Segment>>> =
        caught_up.as_ref().map(|_| model.inputs.iter().zip(columns).map(|(i, c)| segments(i.hold, c, period)).collect());
    let driven = late.as_ref().unwrap_or(pieces);
    let mut plant = Plant::new(model, period, &Options::default()).ok()?;
    let wanted = if substeps == TWICE { 2 * plant.substeps() } else { plant.substeps().min(substeps) };
    if wanted != plant.substeps() {
        plant = Plant::new(model, period, &Options { substeps: Some(wanted), ..Options::default() }).ok()?;
    }
    budget.simulated(SETTING_UP + samples.min(length) as u64 * plant.cost());
    let mut first: Vec<f64> = columns.iter().map(|samples| samples.first().copied().unwrap_or(0.0)).collect();
    first.extend(moved.iter().map(|path| path.first().map_or(0.0, |s| s.c[0])));
    plant.start_at(&first);
    for (body, position, velocity) in record.begins.iter().chain(starts) {
        plant.set_motion(*body, *position, *velocity);
    }
    let mut now = vec![Segment::default(); driven.len() + moved.len()];
    for sample in 0..samples.min(length) {
        show(&mut plant, sample);
        if sample % 256 == 0 && !plant.is_finite() {
            return None;
        }
        if sample + 1 < samples.min(length) {
            let columns = driven.iter().chain(moved.iter().map(|path| path.as_ref()));
            for (segment, column) in now.iter_mut().zip(columns) {
                *segment = column[sample];
            }
            plant.step(&now);
        }
    }
    Some(())
}
