//! A model simulated on a recording: the readings of its sensors before rounding.

use crate::output_error::coupling::Coupling;
use crate::output_error::work::{Budget, Steps};
use crate::recordings::problem::{Logged, Record};
use crate::tuning::tuning;
use backdrive_plant::model::Model;
use backdrive_plant::set::Condition;
use backdrive_plant::stepper::{LANES, Options, Plant, Segment, Tangents, ahead, segments};
use std::borrow::Cow;
use std::sync::Arc;

/// What it takes to set a simulation up.
const SETTING_UP: Steps = 200;

/// As a number of substeps: twice as many as the model asks for.
pub const TWICE: usize = usize::MAX;

/// A motion that a record starts with: body, position in m, velocity in m/s.
pub type Start = (usize, f64, f64);

/// An input and its samples, which replace those of a record.
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
    run(model, &[], record, logged, conditions, length, &mut |plant, _, sample| {
        plant.outputs(&mut values);
        for (column, output) in measured.iter().enumerate() {
            columns[column * length + sample] = values[*output];
        }
    })?;
    if let Some(logged) = logged {
        columns = columns.chunks_exact(length).flat_map(|column| logged.read(column)).collect();
    }
    as_filtered(record, &mut columns);
    columns.iter().all(|y| y.is_finite()).then_some(columns)
}

/// Derivatives of the same predictions by up to [`LANES`] parameters, carried along with the motion: `derivatives[parameter]` is as long as the
/// predictions. Each parameter is given by a model that differs in it alone, and by how much. `None` where the motion cannot be followed, as that of a linear
/// model or where a parameter belongs to an input or output, and where the model cannot be simulated.
pub fn derivatives_under(model: &Model, moved: &[(Model, f64)], record: &Record, conditions: &Conditions) -> Option<Vec<Vec<f64>>> {
    let measured: Vec<usize> = (0..model.outputs.len()).filter(|o| record.outputs.get(*o).is_some_and(Option::is_some)).collect();
    let logged = record.logged.as_deref().filter(|_| conditions.coupling.is_none() && conditions.curves.is_empty());
    let length = logged.map_or(record.len, Logged::len);
    let mut columns = vec![vec![0.0; measured.len() * length]; moved.len()];
    let (mut values, mut now) = (vec![0.0; model.outputs.len()], vec![vec![0.0; model.outputs.len()]; moved.len()]);
    run(model, moved, record, logged, conditions, length, &mut |plant, tangents, sample| {
        let Some(tangents) = tangents else { return };
        plant.outputs(&mut values);
        tangents.outputs(plant, &values, &mut now);
        for (columns, now) in columns.iter_mut().zip(&now) {
            for (column, output) in measured.iter().enumerate() {
                columns[column * length + sample] = now[*output];
            }
        }
    })?;
    if let Some(logged) = logged {
        for column in &mut columns {
            *column = column.chunks_exact(length).flat_map(|column| logged.read(column)).collect();
        }
    }
    columns.iter_mut().for_each(|columns| as_filtered(record, columns));
    columns.iter().flatten().all(|y| y.is_finite()).then_some(columns)
}

/// What is predicted of a record's outputs, through the low-pass that its samples went through.
fn as_filtered(record: &Record, columns: &mut [f64]) {
    if let Some(low_pass) = record.low_pass.as_ref() {
        for column in columns.chunks_exact_mut(record.len.max(1)) {
            let filtered = low_pass.both_ways(column);
            column.copy_from_slice(&filtered);
        }
    }
}

/// Position and velocity of each body at a sample of a record.
pub fn motion_at(model: &Model, record: &Record, conditions: &Conditions, at: usize) -> Option<Vec<Start>> {
    let mut motion = Vec::new();
    run(model, &[], record, None, conditions, at + 1, &mut |plant, _, sample| {
        if sample == at {
            motion = (0..model.bodies.len()).map(|body| (body, plant.position(body), plant.velocity(body))).collect();
        }
    })?;
    motion.iter().all(|(_, x, v)| x.is_finite() && v.is_finite()).then_some(motion)
}

/// How bodies on motion inputs are moved, one after the other.
type Paths = Vec<Arc<Vec<Segment>>>;

/// What a simulation shows at each sample: the plant, what follows it, and which sample.
type Show<'s> = &'s mut dyn FnMut(&mut Plant, Option<&mut Tangents>, usize);

/// A model under the conditions of a record, coupled where it is to be, and the paths of the bodies that pull it.
fn conditioned<'m>(model: &'m Model, record: &Record, conditions: &Conditions) -> Option<(Cow<'m, Model>, Paths)> {
    let mut changed = Cow::Borrowed(model);
    for (path, condition) in &record.conditions {
        if let Condition::Value(value) = condition {
            changed.to_mut().set_values_at(path, &[*value]).ok()?;
        }
    }
    match conditions.coupling.filter(|(g, _)| !g.is_empty()) {
        Some((coupling, index)) => coupling.attach(&changed, index, record.period).map(|(model, paths)| (Cow::Owned(model), paths)),
        None => Some((changed, Vec::new())),
    }
}

/// Simulates a model on the first samples of a record, or points of the grid of one that is `logged` at times of its own, and calls `show` at each.
/// Derivatives by the parameters of `moved` come along; `None`, too, where they cannot.
fn run(
    model: &Model,
    moved: &[(Model, f64)],
    record: &Record,
    logged: Option<&Logged>,
    conditions: &Conditions,
    samples: usize,
    show: Show,
) -> Option<()> {
    let Conditions { starts, curves, substeps, budget, .. } = *conditions;
    let (inputs, driving, period, length) = match logged {
        Some(logged) => (&logged.inputs, &logged.segments, logged.step, logged.len()),
        None => (&record.inputs, &record.segments, record.period, record.len),
    };
    // So many substeps are meant per sample.
    let substeps = if substeps == TWICE || logged.is_none() { substeps } else { substeps.div_ceil(tuning().recordings.grid_steps) };
    let (model, pulled) = conditioned(model, record, conditions)?;
    let (mut own_inputs, mut own_segments) = (Vec::new(), Vec::new());
    if !curves.is_empty() {
        (own_inputs, own_segments) = (inputs.clone(), driving.clone());
        for (input, samples) in curves {
            *own_inputs.get_mut(*input)? = samples.clone();
            *own_segments.get_mut(*input)? = segments(model.inputs.get(*input)?.hold, samples, period);
        }
    }
    let (recorded, pieces) = if curves.is_empty() { (inputs, driving) } else { (&own_inputs, &own_segments) };
    let caught_up = ahead(&model, recorded, period);
    let (ready, columns) = caught_up.as_ref().map_or((&*model, recorded), |(model, columns)| (model, columns));
    let late: Option<Vec<Vec<Segment>>> =
        caught_up.as_ref().map(|_| ready.inputs.iter().zip(columns).map(|(i, c)| segments(i.hold, c, period)).collect());
    let driven = late.as_ref().unwrap_or(pieces);
    let mut plant = Plant::new(ready, period, &Options::default()).ok()?;
    let wanted = if substeps == TWICE { 2 * plant.substeps() } else { plant.substeps().min(substeps) };
    if wanted != plant.substeps() {
        plant = Plant::new(ready, period, &Options { substeps: Some(wanted), ..Options::default() }).ok()?;
    }
    let mut tangents = None;
    if !moved.is_empty() {
        let mut lanes = Vec::with_capacity(moved.len().min(LANES));
        for (changed, step) in moved {
            let mut changed = conditioned(changed, record, conditions)?.0.into_owned();
            if changed.inputs != model.inputs {
                return None;
            }
            changed.inputs.clone_from(&ready.inputs);
            lanes.push((changed, *step));
        }
        tangents = Some(Tangents::new(&plant, ready, &lanes, period)?);
    }
    let followed = moved.len() as u64;
    budget.simulated((1 + followed) * SETTING_UP + samples.min(length) as u64 * (plant.cost() + followed * plant.cost_of_a_lane()));
    let mut first: Vec<f64> = columns.iter().map(|samples| samples.first().copied().unwrap_or(0.0)).collect();
    first.extend(pulled.iter().map(|path| path.first().map_or(0.0, |s| s.c[0])));
    plant.start_at(&first);
    if let Some(tangents) = &mut tangents {
        tangents.start_at(&first);
    }
    for (body, position, velocity) in record.begins.iter().chain(starts) {
        plant.set_motion(*body, *position, *velocity);
        if let Some(tangents) = &mut tangents {
            tangents.set_motion(*body, *position, *velocity);
        }
    }
    let mut now = vec![Segment::default(); driven.len() + pulled.len()];
    for sample in 0..samples.min(length) {
        show(&mut plant, tangents.as_mut(), sample);
        if sample % 256 == 0 && !plant.is_finite() {
            return None;
        }
        if sample + 1 < samples.min(length) {
            let columns = driven.iter().chain(pulled.iter().map(|path| path.as_ref()));
            for (segment, column) in now.iter_mut().zip(columns) {
                *segment = column[sample];
            }
            match &mut tangents {
                Some(tangents) => tangents.step(&mut plant, &now),
                None => plant.step(&now),
            }
        }
    }
    Some(())
}
