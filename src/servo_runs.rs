//! `simulate` and `fit` of a model whose joints position servos drive.

use crate::cli;
use crate::failure::Failure;
use crate::output::{self, may_replace};
use crate::progress;
use backdrive_pages::estimate::estimate;
use backdrive_plant::model::Model;
use backdrive_plant::recording::{Recording, write_csv};
use backdrive_plant::servo::Numbers;
use backdrive_plant::set::RecordingSet;
use backdrive_report::number;
use backdrive_servo::problem::Problem;
use backdrive_servo::refit::{Refitted, refit};
use backdrive_servo::run::free_runs;
use backdrive_servo::search::scored;
use backdrive_sets::open;
use backdrive_signal::statistics::deviation;
use serde_json::json;
use std::path::{Path, PathBuf};

/// The parameters that the model states of each joint of the problem.
fn stated(problem: &Problem) -> Vec<Option<Numbers>> {
    problem.joints.iter().map(|j| j.given).collect()
}

/// Runs the joints from the commands of recordings, writes their positions, and prints their difference from the recorded ones.
pub fn simulate(options: &cli::Simulate, model: &Model) -> Result<u8, Failure> {
    let path = PathBuf::from(&options.drive);
    let (mut set, _) = open::set_of(std::slice::from_ref(&path))?;
    if let Some(columns) = &options.columns {
        let other = RecordingSet::open(columns)?;
        (set.columns, set.joints) = (other.columns, other.joints);
    }
    let problem =
        progress::busy(&format!("reading {}", options.drive), || Problem::open(&set, Some(&options.model))).map_err(Failure::input)?;
    if stated(&problem).iter().all(Option::is_none) {
        let names: Vec<&str> = model.servos.iter().map(|s| s.joint.as_str()).collect();
        return Err(Failure::input(format!(
            "{}: holds no joint that {} has a [servo] of; it has {}",
            options.drive,
            options.model.display(),
            names.join(", ")
        )));
    }
    let is_file = path.is_file()
        && path.file_name().is_some_and(|n| n != "set.toml")
        && path.extension().is_some_and(|e| !e.eq_ignore_ascii_case("toml"));
    let mut runs = Vec::new();
    for (held_out, files) in [(false, &set.fit), (true, &set.held_out)] {
        for (index, file) in files.iter().enumerate() {
            let out = if is_file {
                options.out.clone()
            } else {
                options.out.join(Path::new(backdrive_pages::parts::file_name(file)).with_extension("csv"))
            };
            may_replace(&out, options.overwrite)?;
            let positions = free_runs(&problem, &stated(&problem), held_out, index).map_err(Failure::input)?;
            runs.push(written(&problem, &positions, held_out, index, file, &out, options)?);
        }
    }
    if options.json {
        output::line(json!({ "model": model.name, "runs": runs }))?;
    }
    Ok(0)
}

fn written(
    problem: &Problem,
    positions: &[Vec<f64>],
    held_out: bool,
    index: usize,
    file: &str,
    out: &Path,
    options: &cli::Simulate,
) -> Result<serde_json::Value, Failure> {
    let mut signals = Vec::new();
    let mut errors = serde_json::Map::new();
    let mut lines = Vec::new();
    let mut times = Vec::new();
    for (joint, simulated) in problem.joints.iter().zip(positions).filter(|(j, _)| j.given.is_some()) {
        let record = if held_out { &joint.held_out[index] } else { &joint.fit[index] };
        times.clone_from(&record.t);
        signals.push((format!("{}.command", joint.name), record.command.clone()));
        signals.push((format!("{}.position", joint.name), simulated.clone()));
        let (share, absolute) = scored(simulated, &record.position);
        // A joint that rests has no nrmse.
        let share = (deviation(&record.position) > 1e-6).then_some(share);
        let told = share.map_or("-".to_string(), |s| format!("{s:.4}"));
        lines.push(format!("  {:<24} nrmse {told}, mean error {} mrad", joint.name, number(1e3 * absolute)));
        errors.insert(joint.name.clone(), json!({ "nrmse": share, "mean_error_rad": absolute }));
    }
    let samples = times.len();
    let recording = Recording::new(file, times, signals).map_err(Failure::input)?;
    if let Some(folder) = out.parent().filter(|f| !f.as_os_str().is_empty()) {
        output::folder(folder)?;
    }
    output::replace(out, |to| Ok(write_csv(&recording, to)?))?;
    if !options.json {
        output::line(format_args!("{file} -> {}: {samples} samples, free run from the commands", out.display()))?;
        lines.iter().try_for_each(output::line)?;
    }
    Ok(json!({ "recording": file, "out": out, "samples": samples, "joints": errors }))
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
