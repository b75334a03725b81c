//! `simulate` and `fit` of a model whose joints position servos drive.

use crate::cli;
use crate::failure::Failure;
use crate::output::{self, may_replace};
use crate::progress;
use backdrive_pages::estimate::estimate;
use backdrive_plant::model::Model;
use backdrive_predict::servos::{JointError, ServoRuns};
use backdrive_predict::simulate::Options;
use backdrive_report::number;
use backdrive_servo::problem::Problem;
use backdrive_servo::refit::{Refitted, refit};
use backdrive_sets::open;
use serde_json::json;
use std::path::PathBuf;

/// Runs the joints from the commands of recordings, writes their positions, and prints their difference from the recorded ones.
pub fn simulate(asked: &cli::Simulate, options: &Options, model: &Model) -> Result<u8, Failure> {
    let servos = progress::busy(&format!("reading {}", asked.drive), || ServoRuns::read(options, &asked.model, model))?;
    let mut runs = Vec::new();
    for run in &servos.runs {
        let (file, out) = (&run.file, &run.out);
        may_replace(out, asked.overwrite)?;
        let found = servos.predict(run)?;
        output::csv(&found.recording, out)?;
        let samples = found.recording.len();
        if !asked.json {
            output::line(format_args!("{file} -> {}: {samples} samples, free run from the commands", out.display()))?;
            for joint in &found.joints {
                let nrmse = joint.nrmse.map_or("-".to_string(), |s| format!("{s:.4}"));
                output::line(format_args!("  {:<24} nrmse {nrmse}, mean error {} mrad", joint.joint, number(1e3 * joint.mean_rad)))?;
            }
        }
        let error = |j: &JointError| (j.joint.clone(), json!({ "nrmse": j.nrmse, "mean_error_rad": j.mean_rad }));
        let joints: serde_json::Map<_, _> = found.joints.iter().map(error).collect();
        runs.push(json!({ "recording": file, "out": out, "samples": samples, "joints": joints }));
    }
    if asked.json {
        output::line(json!({ "model": model.name, "runs": runs }))?;
    }
    Ok(0)
}

/// Refits the parameters that the model states of each joint, its structure unchanged.
pub fn fit(options: &cli::Fit) -> Result<u8, Failure> {
    let (mut set, told) = open::set_of(&options.set)?;
    let mut notes = Vec::new();
    open::hold_out(&mut set, told, &mut notes);
    notes.iter().for_each(|note| output::note(format_args!("note: {note}")));
    if let Some(out) = &options.out {
        let files: Vec<PathBuf> =
            std::iter::once(options.model.clone()).chain(set.fit.iter().chain(&set.held_out).map(|f| set.path_of(f))).collect();
        open::not_onto(out, &files, options.overwrite)?;
    }
    let problem = progress::busy("reading the recordings", || Problem::open(&set, Some(&options.model))).map_err(Failure::input)?;
    let fitted = progress::busy("fitting the servo joints", || refit(&problem)).map_err(Failure::input)?;
    if let Some(out) = &options.out {
        output::file(out, fitted.model.to_toml())?;
    }
    if options.json {
        let joints: serde_json::Map<_, _> = fitted
            .joints
            .iter()
            .map(|j| (j.joint.clone(), json!({ "numbers": j.numbers, "given": j.given, "fitted": j.fitted })))
            .collect();
        output::json(&json!({ "model": problem.model.name, "joints": joints }))?;
    } else {
        fitted.joints.iter().try_for_each(told_of)?;
        if let Some(out) = &options.out {
            output::line(format_args!("wrote     {}", out.display()))?;
        }
    }
    Ok(0)
}

fn told_of(joint: &Refitted) -> Result<(), Failure> {
    let share = |x: Option<f64>| x.map_or("-".to_string(), |x| format!("{x:.4}"));
    output::line(format_args!("{}: free run nrmse {} as given, {} fitted", joint.joint, share(joint.given), share(joint.fitted)))?;
    for (key, value) in &joint.numbers {
        output::line(format_args!("  {:<22} {}", key.replace('_', " "), estimate(value)))?;
    }
    Ok(())
}
