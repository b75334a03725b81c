//! A device of which nothing is missing: the model that was found, moved by the recorded controller along the recorded references, its position
//! rounded as the encoder rounds. The diagnosis of its own model must say that nothing is missing.

use super::prepare::{GTAU, RATE, Record};
use crate::run::{Ask, diagnose, said, write};
use crate::table::Report;
use crate::{Context, StudyError};
use backdrive_diagnosis::verdict::Word;
use backdrive_plant::model::{Hold, InputKind, Model, OutputKind};
use backdrive_plant::stepper::{Options, Plant, Segment};

/// The controller: position gain, 1/s; velocity gain, V per m/s; limit, V. Published, and recovered from the records to some millivolts.
const KP: f64 = 160.18;
const KV: f64 = 243.45;
const LIMIT: f64 = 10.0;
/// Voltage per unit of the pulses, regressed on the record.
const PULSE: f64 = 1.0139;
/// Step of the encoder, m.
const STEP: f64 = 5e-8;

pub(super) fn run(report: &mut Report, context: &Context, model: &Model, train: &Record, pulses: &Record) -> Result<(), StudyError> {
    write(&context.out.join("found.toml"), &model.to_toml())?;
    let fit = simulated(model, train)?.write_strokes(context.out, "null-train")?;
    let held_out = simulated(model, pulses)?.write_strokes(context.out, "null-pulses")?;
    write(&context.out.join("null-set.toml"), &format!("model = \"model.toml\"\nfit = {fit:?}\nheld_out = {held_out:?}\n"))?;
    let ask = Ask { name: "null", set: "null-set.toml", model: "found.toml", without: &[], effects: 3, effort: 2.5 };
    let found = diagnose(context, &ask)?;
    let word = found.verdict.word;
    report.word("null verdict", word.name());
    report.line(
        "its own model, simulated with its controller",
        said(&found.verdict),
        "nothing missing",
        "",
        Some(word == Word::NothingMissing),
    );
    Ok(())
}

/// The model under the controller, along a record's reference and pulses.
fn simulated(model: &Model, record: &Record) -> Result<Record, StudyError> {
    let mut driven = model.clone();
    let period = 1.0 / RATE;
    for input in &mut driven.inputs {
        // The fit took a force as the samples say it; held for a sample, it acts half a sample later by itself.
        let late = -input.delay - 0.5 * period;
        (input.kind, input.hold, input.delay) = (InputKind::Force, Hold::Zero, late.max(0.0));
    }
    for output in &mut driven.outputs {
        output.kind = OutputKind::Position(driven.inputs.first().map_or(0, |i| i.on));
    }
    let mut plant = Plant::new(&driven, period, &Options::default()).map_err(|e| StudyError::Diagnosis(e.to_string()))?;
    let (mut force, mut position) = (Vec::new(), Vec::new());
    let mut past = [0.0; 2];
    let mut read = vec![0.0; driven.outputs.len()];
    for (asked, pulse) in record.asked.iter().zip(&record.pulses) {
        plant.outputs(&mut read);
        let q = STEP * (read.first().copied().unwrap_or(0.0) / STEP).round();
        // Backward difference of the mean of two samples.
        let speed = (q - past[1]) / (2.0 * period);
        past = [q, past[0]];
        let u = (KV * (KP * (asked - q) - speed) + PULSE * pulse).clamp(-LIMIT, LIMIT);
        force.push(GTAU * u);
        position.push(q);
        plant.step(&[Segment::held(GTAU * u)]);
    }
    Ok(Record::new(force, &position, record.asked.clone(), record.pulses.clone()))
}
