//! A device that forces drive, read the other way round: the motion that was measured as input, the force that drove it as what is compared.
//!
//! What a simulation leaves out drives its motion ever farther from the device's, so that one effect hides all others. Forces along the measured motion do not
//! drift: each law adds to them where it acts.

use super::band::has_memory;
use crate::problem::{Problem, Record, spread};
use backdrive_plant::model::{Hold, Input, InputKind, Model, Output, OutputKind};
use backdrive_plant::set::Initial;
use backdrive_plant::stepper::segments;
use backdrive_plant::write::{Edit, Value};
use std::sync::Arc;

/// What a problem that was turned round is of.
#[derive(Debug, Clone)]
pub struct Inverse {
    /// The problem as it was recorded.
    pub recorded: Arc<Problem>,
    /// The output that is now the motion.
    pub motion: String,
    /// The input that is now compared; the first where several forces act on the body.
    pub force: String,
}

impl Inverse {
    /// Edits of the model that was turned round, as those of the model as its file has it. A motion that is ahead of its recording is a force that acts late; the
    /// other way round no model of a device that is driven by forces can have it.
    pub fn in_file(&self, edits: Vec<Edit>) -> Vec<Edit> {
        let delay = format!("inputs.{}.delay", self.motion);
        let one = |edit: Edit| match edit {
            Edit::Set { path, value: Value::Number(late), comment } if path == delay => {
                let path = format!("inputs.{}.delay", self.force);
                (late < 0.0).then_some(Edit::Set { path, value: Value::Number(-late), comment })
            }
            other => Some(other),
        };
        edits.into_iter().filter_map(one).collect()
    }
}

/// The problem turned round; `None` unless it is one body without memory, driven by recorded forces alone, with its position recorded in every file.
pub(crate) fn inverse(problem: &Problem) -> Option<Problem> {
    let model = &problem.model;
    let is_known = |record: &Record| {
        let measured = |output: &usize| record.outputs.get(*output).is_some_and(Option::is_some);
        record.conditions.is_empty() && position(model).as_ref().is_some_and(measured)
    };
    let is_plain = |i: &Input| {
        i.kind == InputKind::Force && i.delay == 0.0 && i.saturation.is_infinite() && i.bandwidth.is_infinite() && i.back_emf == 0.0
    };
    let applies = model.bodies.len() == 1
        && model.arm.is_none()
        && problem.unknown.is_empty()
        && model.inputs.iter().all(is_plain)
        && !model.elements.iter().any(|e| has_memory(e.law.kind().name))
        && problem.fit.iter().chain(&problem.held_out).all(is_known);
    if !applies {
        return None;
    }
    let (output, force) = (position(model)?, model.inputs.first()?);
    let motion = model.outputs.get(output)?;
    let turned = Model {
        inputs: vec![Input::ideal(&motion.name, InputKind::Motion, 0, Hold::Cubic)],
        outputs: vec![Output {
            name: force.name.clone(),
            kind: OutputKind::Reaction(0),
            gain: 1.0,
            delay: 0.0,
            offset: 0.0,
            resolution: 0.0,
            noise: 0.0,
        }],
        axes: Vec::new(),
        ..model.clone()
    };
    let of = |records: &[Record]| records.iter().map(|record| turned_record(model, output, record)).collect::<Option<Vec<Record>>>();
    let (fit, held_out) = (of(&problem.fit)?, of(&problem.held_out)?);
    let inverse = Inverse { recorded: Arc::new(problem.clone()), motion: motion.name.clone(), force: force.name.clone() };
    let problem = Problem::new(problem.text.clone(), problem.model_path.clone(), turned, fit, held_out, Initial::Rest).ok()?;
    Some(Problem { inverse: Some(inverse), ..problem })
}

/// The output that is the body's position, delayed by nothing.
fn position(model: &Model) -> Option<usize> {
    model.outputs.iter().position(|o| matches!(o.kind, OutputKind::Position(0)) && o.delay == 0.0 && o.gain != 0.0)
}

fn turned_record(model: &Model, output: usize, record: &Record) -> Option<Record> {
    let sensor = model.outputs.get(output)?;
    let motion: Vec<f64> = record.outputs.get(output)?.as_ref()?.iter().map(|y| (y - sensor.offset) / sensor.gain).collect();
    let mut force = vec![0.0; record.len];
    for (input, samples) in model.inputs.iter().zip(&record.inputs) {
        // What is held from sample to sample acts half a sample later on average: around a sample, half the one before.
        let before = |i: usize| if input.hold == Hold::Zero { samples.get(i.saturating_sub(1)) } else { samples.get(i) };
        for (i, (sum, now)) in force.iter_mut().zip(samples).enumerate() {
            *sum += input.gain * 0.5 * (now + before(i)?);
        }
    }
    let (inputs, outputs) = (vec![motion], vec![Some(force)]);
    let segments = inputs.iter().map(|samples| segments(Hold::Cubic, samples, record.period)).collect();
    let spread = outputs.iter().flatten().map(|samples| spread(samples)).collect();
    Some(Record {
        inputs,
        outputs,
        segments,
        spread,
        begins: Vec::new(),
        skip: 0,
        before: 0,
        logged: None,
        outliers: Vec::new(),
        ..record.clone()
    })
}
