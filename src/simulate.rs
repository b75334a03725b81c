//! `backdrive simulate`: a model run on recordings or on an excitation. The work is that of [`backdrive_predict::simulate`].

use crate::cli;
use crate::failure::Failure;
use crate::output::{self, may_replace};
use crate::progress::busy;
use crate::servo_runs;
use backdrive_predict::held::held_model;
use backdrive_predict::simulate::{Options, drives};
use serde_json::json;

/// Simulates, writes the predictions, and prints their difference from what was recorded.
pub fn simulate(asked: &cli::Simulate) -> Result<u8, Failure> {
    let model = held_model(&asked.model, asked.grip.as_deref())?;
    let options = resolved(asked);
    if !model.servos.is_empty() {
        return servo_runs::simulate(asked, &options, &model);
    }
    let mut results = Vec::new();
    let drives = busy(&format!("reading {}", asked.drive), || drives(&options, &model))?;
    drives.iter().try_for_each(|drive| may_replace(&drive.out, asked.overwrite))?;
    for drive in drives {
        let (name, out) = (&drive.recording.name, &drive.out);
        let found = busy(&format!("simulating {name}"), || drive.predict(&model, &options))?;
        found.notes.iter().for_each(|note| output::note(format_args!("note: {note}")));
        output::csv(&found.recording, out)?;
        let (samples, period) = (found.recording.len(), found.recording.period);
        if !asked.json {
            output::line(format_args!("{name} -> {}: {samples} samples of {period:.6} s", out.display()))?;
            for (output, nrmse) in &found.nrmse {
                output::line(format_args!("  {output:<24} nrmse {nrmse:.4}"))?;
            }
        }
        let fits: serde_json::Map<_, _> = found.nrmse.into_iter().map(|(name, nrmse)| (name, json!(nrmse))).collect();
        results.push(json!({ "recording": name, "out": out, "samples": samples, "period_s": period, "nrmse": fits }));
    }
    if asked.json {
        output::line(json!({ "model": model.name, "runs": results }))?;
    }
    Ok(0)
}

/// The options of the work.
fn resolved(asked: &cli::Simulate) -> Options {
    Options {
        drive: asked.drive.clone(),
        out: asked.out.clone(),
        input: asked.input.clone(),
        rate: asked.rate,
        substeps: asked.substeps,
        noise: asked.noise,
        columns: asked.columns.clone(),
    }
}
