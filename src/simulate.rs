//! `backdrive simulate`: a model run on recordings or on an excitation. The work is that of [`backdrive_predict::simulate`].

use crate::cli;
use crate::failure::Failure;
use crate::model_run::Run;
use crate::output::{self, may_replace};
use crate::progress::busy;
use crate::servo_runs;
use backdrive_plant::model::Model;
use backdrive_predict::held::held_model;
use backdrive_predict::simulate::{Drive, Driver, Options, drives};
use serde_json::{Value, json};
use std::path::Path;

/// Simulates, writes the predictions, and prints their difference from what was recorded.
pub fn simulate(asked: &cli::Simulate) -> Result<u8, Failure> {
    let may_write = |out: &Path| may_replace(out, asked.overwrite);
    let mut write = |run: Run| {
        output::csv(&run.recording, &run.out)?;
        if !asked.json {
            run.lines.iter().try_for_each(output::line)?;
        }
        Ok(())
    };
    let all = simulated(&asked.model, asked.grip.as_deref(), &resolved(asked), &may_write, &mut write)?;
    if asked.json {
        output::line(all)?;
    }
    Ok(0)
}

/// Simulates, and gives what programs read of all runs. `may_write` sees the file of each prediction before the work, `each` takes each run.
///
/// # Errors
/// A file is missing or wrong, the motion grows beyond all bounds, or an error of `may_write` and `each`.
pub fn simulated(
    path: &Path,
    grip: Option<&Path>,
    options: &Options,
    may_write: &dyn Fn(&Path) -> Result<(), Failure>,
    each: &mut dyn FnMut(Run) -> Result<(), Failure>,
) -> Result<Value, Failure> {
    let model = held_model(path, grip)?;
    let mut runs = Vec::new();
    let mut take = |run: Run| {
        runs.push(run.json.clone());
        each(run)
    };
    if model.servos.is_empty() {
        let drives = busy(&format!("reading {}", options.drive), || drives(options, &model))?;
        drives.iter().try_for_each(|drive| may_write(&drive.out))?;
        drives.into_iter().try_for_each(|drive| take(run(drive, options, &model)?))?;
    } else {
        servo_runs::simulate(path, options, &model, may_write, &mut take)?;
    }
    Ok(json!({ "model": model.name, "runs": runs }))
}

/// One run, with its difference from what was recorded.
fn run(drive: Drive, options: &Options, model: &Model) -> Result<Run, Failure> {
    let name = &drive.recording.name;
    let found = busy(&format!("simulating {name}"), || drive.predict(model, options))?;
    found.notes.iter().for_each(|note| output::note(format_args!("note: {note}")));
    let (samples, period) = (found.recording.len(), found.recording.period);
    let mut lines = vec![format!("{name} -> {}: {samples} samples of {period:.6} s", drive.out.display())];
    lines.extend(found.nrmse.iter().map(|(output, nrmse)| format!("  {output:<24} nrmse {nrmse:.4}")));
    let fits: serde_json::Map<_, _> = found.nrmse.into_iter().map(|(name, nrmse)| (name, json!(nrmse))).collect();
    let json = json!({ "recording": name, "out": drive.out, "samples": samples, "period_s": period, "nrmse": fits });
    Ok(Run { recording: found.recording, out: drive.out, lines, json })
}

/// The options of the work.
fn resolved(asked: &cli::Simulate) -> Options {
    Options {
        drive: Driver::Named(asked.drive.clone()),
        out: asked.out.clone(),
        input: asked.input.clone(),
        rate: asked.rate,
        substeps: asked.substeps,
        noise: asked.noise,
        columns: asked.columns.clone(),
    }
}
