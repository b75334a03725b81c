//! The position error of open-loop simulation, as leaderboards of this benchmark show it: the model, driven by the recorded force from the first sample
//! of a record, against the recorded position. The axis is a pure integrator there, so that whatever is off by a constant force runs away.

use super::prepare::{RATE, Record};
use crate::run::{Ask, diagnosed_model, refit, write};
use crate::table::Report;
use crate::{Context, StudyError, csv_columns};
use backdrive_plant::model::{Hold, InputKind, Model, OutputKind};
use backdrive_plant::stepper::{Options, simulate};

/// Bar on the error in the record with the pulses, mm.
const BAR: f64 = 3.5;
/// One sample in so many goes into the refit.
const THIN: usize = 4;

/// The published models as they are, and a found one as it is and with its numbers refitted to the training record's position.
pub(super) fn run(report: &mut Report, context: &Context, found: &Model, train: &Record, pulses: &Record) -> Result<(), StudyError> {
    let error = |model: &Model| -> Result<[f64; 2], StudyError> { Ok([rmse(model, train)?, rmse(model, pulses)?]) };
    for (what, file) in [("symmetric form", "symmetric.toml"), ("asymmetric form", "asymmetric.toml")] {
        let model = driven(&Model::load(&context.folder.join(file))?);
        line(report, &format!("published {what}"), error(&model)?, None);
    }
    let model = driven(found);
    let frozen = error(&model)?;
    line(report, "found model, frozen", frozen, Some(frozen[1] <= BAR));
    write(&context.out.join("open-loop.toml"), &model.to_toml())?;
    for (record, name) in [(train, "open-train.csv"), (pulses, "open-pulses.csv")] {
        write_record(context, record, name)?;
    }
    write(
        &context.out.join("open-loop-set.toml"),
        "model = \"model.toml\"\nfit = [\"open-train.csv\"]\nheld_out = [\"open-pulses.csv\"]\ninitial = \"rest\"\n",
    )?;
    let ask = Ask { name: "open-loop", set: "open-loop-set.toml", model: "open-loop.toml", without: &[], effects: 1, effort: 0.85 };
    refit(context, &ask)?;
    let refitted = error(&diagnosed_model(context, &ask)?)?;
    line(report, "found model, refitted to the training record's position", refitted, Some(refitted[1] <= BAR));
    Ok(())
}

fn line(report: &mut Report, what: &str, [here, there]: [f64; 2], within: Option<bool>) {
    report.figure(&format!("open loop {what}"), there);
    report.line(
        &format!("open-loop position error, {what}, training / pulses"),
        format!("{here:.2} / {there:.2} mm"),
        "5.17 mm polynomial NARX, 3.84 to 4.3 mm refitted physics",
        "leaderboards of the benchmark",
        within,
    );
}

/// A model that was moved, driven by the force instead.
fn driven(model: &Model) -> Model {
    let mut model = model.clone();
    let period = 1.0 / RATE;
    let mut offset = 0.0;
    for input in &mut model.inputs {
        // What was found is a motion that is late behind samples of the force; held for a sample, the force is late by half of one by itself.
        let late = -input.delay - 0.5 * period;
        offset += input.offset;
        (input.name, input.kind, input.hold, input.delay, input.offset) =
            ("force".to_string(), InputKind::Force, Hold::Zero, late.max(0.0), 0.0);
    }
    for output in &mut model.outputs {
        output.name = "position".to_string();
        output.kind = OutputKind::Position(model.inputs.first().map_or(0, |i| i.on));
        (output.offset, output.delay, output.noise) = (output.offset - offset, 0.0, 0.0);
    }
    model
}

/// Root mean square of the position error from the first sample to the last, mm.
fn rmse(model: &Model, record: &Record) -> Result<f64, StudyError> {
    let failed = |e: &dyn std::fmt::Display| StudyError::Diagnosis(format!("{}: {e}", model.name));
    let predicted = simulate(model, &[&record.force], 1.0 / RATE, &Options::default()).map_err(|e| failed(&e))?;
    let predicted = predicted.first().ok_or_else(|| failed(&"has no output"))?;
    let (begin, own) = (record.position.first().copied().unwrap_or(0.0), predicted.first().copied().unwrap_or(0.0));
    let square: f64 = record.position.iter().zip(predicted).map(|(m, p)| (m - begin - p + own).powi(2)).sum();
    Ok(1e3 * (square / record.position.len().max(1) as f64).sqrt())
}

/// A record for the refit: force and position from the first sample.
fn write_record(context: &Context, record: &Record, name: &str) -> Result<(), StudyError> {
    let begin = record.position.first().copied().unwrap_or(0.0);
    let force: Vec<f64> = record.force.chunks_exact(THIN).map(|c| c.iter().sum::<f64>() / THIN as f64).collect();
    let position: Vec<f64> = record.position.iter().step_by(THIN).map(|q| q - begin).take(force.len()).collect();
    let t: Vec<f64> = (0..force.len()).map(|i| (i * THIN) as f64 / RATE).collect();
    csv_columns::write(&context.out.join(name), &["t", "force", "position"], &[&t, &force, &position])
}
