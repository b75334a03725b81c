//! `backdrive simulate`: a model run on recordings or on an excitation.

use crate::cli;
use crate::failure::Failure;
use crate::output;
use crate::output::may_replace;
use crate::progress::busy;
use crate::servo_runs;
use backdrive_bags::{Reader, recording, topic_of};
use backdrive_plant::excitation::{Excitation, load_experiments};
use backdrive_plant::model::{Fragment, Hold, Model, OutputKind};
use backdrive_plant::recording::{Columns, Piece, Recording, read_signals_of, signals_of, write_csv};
use backdrive_plant::robot::Payload;
use backdrive_plant::set::{Condition, RecordingSet};
use backdrive_plant::stepper::{Options, simulate as simulate_model};
use serde_json::json;
use std::path::{Component, Path, PathBuf};

/// Simulates, writes the predictions, and prints their difference from what was recorded.
pub fn simulate(options: &cli::Simulate) -> Result<u8, Failure> {
    let model = held_model(&options.model, options.grip.as_deref())?;
    if !model.servos.is_empty() {
        return servo_runs::simulate(options, &model);
    }
    let mut results = Vec::new();
    let drives = busy(&format!("reading {}", options.drive), || drives(options, &model))?;
    drives.iter().try_for_each(|drive| may_replace(&drive.out, options.overwrite))?;
    for Drive { recording: drive, out, condition, payload } in drives {
        let model = under(&model, &condition, payload.as_ref(), &drive.name)?;
        let prediction = busy(&format!("simulating {}", drive.name), || predict(&model, &drive, options))?;
        if let Some(folder) = out.parent().filter(|f| !f.as_os_str().is_empty()) {
            output::folder(folder)?;
        }
        output::replace(&out, |to| Ok(write_csv(&prediction, to)?))?;
        let fits = compare(&model, &drive, &prediction);
        if !options.json {
            output::line(format_args!("{} -> {}: {} samples of {:.6} s", drive.name, out.display(), prediction.len(), prediction.period))?;
            for (output, nrmse) in &fits {
                output::line(format_args!("  {output:<24} nrmse {nrmse:.4}"))?;
            }
        }
        let fits: serde_json::Map<_, _> = fits.into_iter().map(|(name, nrmse)| (name, json!(nrmse))).collect();
        results.push(
            json!({ "recording": drive.name, "out": out, "samples": prediction.len(), "period_s": prediction.period, "nrmse": fits }),
        );
    }
    if options.json {
        output::line(json!({ "model": model.name, "runs": results }))?;
    }
    Ok(0)
}

/// What drives the model, where its prediction goes, and what is different in this experiment.
struct Drive {
    recording: Recording,
    out: PathBuf,
    condition: Vec<(String, Condition)>,
    payload: Option<Payload>,
}

/// The model under the conditions of one experiment. What is to be estimated there keeps its number.
fn under(model: &Model, condition: &[(String, Condition)], payload: Option<&Payload>, recording: &str) -> Result<Model, Failure> {
    let mut model = model.clone();
    if let (Some(payload), Some(arm)) = (payload, &model.arm) {
        let arm = arm.carrying(payload).map_err(|e| Failure::input(format!("{recording}: payload: {e}")))?;
        model.arm = Some(Box::new(arm));
    }
    for (path, value) in condition {
        match value {
            Condition::Value(value) => {
                model.set_values_at(path, &[*value]).map_err(|e| Failure::input(format!("{recording}: condition {path}: {e}")))?
            }
            Condition::Free | Condition::Shared(_) => {
                output::note(format_args!("note: {recording}: {path} is free in this file; the model's own number is used"))
            }
        }
    }
    Ok(model)
}

/// A model with a grip or an environment attached where one is given.
pub fn held_model(path: &Path, grip: Option<&Path>) -> Result<Model, Failure> {
    let mut model = Model::load(path)?;
    let Some(grip) = grip else { return Ok(model) };
    let fragment = Fragment::load(grip)?;
    if model.axes.is_empty() {
        return Err(Failure::input(format!("{}: has no [[axes]], so a grip has nowhere to attach", path.display())));
    }
    let several = model.axes.len() > 1;
    for (number, axis) in model.axes.clone().iter().enumerate().filter(|(_, axis)| !axis.holds_user) {
        let prefix = if several { format!("{}{number}", fragment.network.name) } else { fragment.network.name.clone() };
        model.attach(&fragment, axis.user, &prefix);
    }
    Ok(model)
}

/// What drives the model, and where each prediction goes.
fn drives(options: &cli::Simulate, model: &Model) -> Result<Vec<Drive>, Failure> {
    let path = Path::new(&options.drive);
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let columns = match &options.columns {
        Some(set) => RecordingSet::open(set)?.columns,
        None => Columns::new(),
    };
    if path.is_dir() || path.file_name().is_some_and(|n| n == "set.toml") {
        let set = RecordingSet::open(path)?;
        set.check_conditions(model)?;
        let files: Vec<&String> = set.fit.iter().chain(&set.held_out).collect();
        return files
            .into_iter()
            .map(|file| {
                let rules = set.rules_of(file);
                let recording = read_recording(&set.path_of(file), model, &set.columns, &rules.piece)?;
                // A recording outside the folder is simulated into the folder all the same, and not onto itself.
                let path = Path::new(file);
                let inside = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
                let name = if inside { path } else { Path::new(path.file_name().unwrap_or_default()) };
                Ok(Drive {
                    recording,
                    out: options.out.join(name.with_extension("csv")),
                    condition: rules.condition,
                    payload: rules.payload,
                })
            })
            .collect();
    }
    if extension == "csv" || extension == "mcap" {
        let recording = read_recording(path, model, &columns, &Piece::default())?;
        return Ok(vec![Drive { recording, out: options.out.clone(), condition: Vec::new(), payload: None }]);
    }
    if extension == "toml" {
        let experiments = load_experiments(path)?;
        let single = experiments.len() == 1;
        return experiments
            .iter()
            .map(|experiment| {
                let out = if single { options.out.clone() } else { options.out.join(format!("{}.csv", experiment.name)) };
                Ok(Drive {
                    recording: excited(model, &experiment.name, &experiment.drives, options)?,
                    out,
                    condition: Vec::new(),
                    payload: None,
                })
            })
            .collect();
    }
    let excitation: Excitation = options.drive.parse().map_err(|e| {
        Failure::input(format!("{e}; it is no recording either: those end in .csv or .mcap, or are a folder with a set.toml"))
    })?;
    let drive = [(options.input.clone(), excitation)];
    Ok(vec![Drive {
        recording: excited(model, &options.drive, &drive, options)?,
        out: options.out.clone(),
        condition: Vec::new(),
        payload: None,
    }])
}

/// The signals of a model from a recording: all of its inputs, and those of its outputs that were recorded.
pub fn read_recording(path: &Path, model: &Model, columns: &Columns, piece: &Piece) -> Result<Recording, Failure> {
    let is_bag = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap"));
    let is_hand = |name: &str| name.ends_with(".hand");
    let recording = match is_bag {
        true => from_bag(path, model, columns, piece)?,
        false => read_signals_of(path, model, columns, piece, &is_hand)?,
    };
    for input in &model.inputs {
        if recording.signal(&input.name).is_none() && !is_hand(&input.name) {
            let there: Vec<&str> = recording.signals.iter().map(|(name, _)| name.as_str()).collect();
            let there = if there.is_empty() { "nothing else".to_string() } else { there.join(", ") };
            return Err(Failure::input(format!(
                "{}: has no signal \"{}\", which drives the model; it has {there}; name the column in [columns]",
                path.display(),
                input.name
            )));
        }
    }
    recording.check_units(model).map_err(Failure::input)?;
    recording.regular_for(model).map_err(Failure::input)
}

fn from_bag(path: &Path, model: &Model, columns: &Columns, piece: &Piece) -> Result<Recording, Failure> {
    let reader = Reader::open(path).map_err(Failure::input)?;
    let there = |name: &str| columns.iter().any(|(signal, _)| signal == name) || reader.topic(&topic_of(name)).is_ok();
    let wanted: Vec<&str> = signals_of(model).into_iter().filter(|name| there(name)).collect();
    if wanted.is_empty() {
        let topics: Vec<&str> = reader.topics().iter().map(|t| t.name.as_str()).collect();
        return Err(Failure::input(format!(
            "{}: say in [columns] of a set.toml which topics hold {}; the bag has {}",
            path.display(),
            signals_of(model).join(", "),
            topics.join(", ")
        )));
    }
    let hold = |name: &str| model.inputs.iter().find(|i| i.name == name).map_or(Hold::Linear, |i| i.hold);
    recording(&reader, Some(&wanted), columns, piece, &hold).map_err(Failure::input)
}

/// A recording of inputs only, made from excitations.
fn excited(model: &Model, name: &str, drives: &[(Option<String>, Excitation)], options: &cli::Simulate) -> Result<Recording, Failure> {
    if !(options.rate.is_finite() && options.rate > 0.0) {
        return Err(Failure { code: 2, message: format!("--rate must be above 0, is {}", options.rate) });
    }
    let mut inputs: Vec<(String, Vec<f64>)> = Vec::new();
    for (input, excitation) in drives {
        let target = match input {
            Some(name) => model.inputs.iter().find(|i| i.name == *name).ok_or_else(|| {
                let known = model.inputs.iter().map(|i| i.name.as_str());
                Failure::input(backdrive_plant::tomlfile::unknown("input", name, known))
            })?,
            None => model.inputs.first().ok_or_else(|| Failure::input(format!("model \"{}\" has no input to drive", model.name)))?,
        };
        inputs.push((target.name.clone(), excitation.samples(options.rate).map_err(Failure::input)?));
    }
    let longest = inputs.iter().map(|(_, samples)| samples.len()).max().unwrap_or(0);
    inputs.iter_mut().for_each(|(_, samples)| samples.resize(longest, 0.0));
    for input in &model.inputs {
        if !inputs.iter().any(|(name, _)| *name == input.name) {
            inputs.push((input.name.clone(), vec![0.0; longest]));
        }
    }
    let t = (0..longest).map(|i| i as f64 / options.rate).collect();
    Recording::new(name, t, inputs).map_err(Failure::input)
}

/// The model's outputs beside the inputs that drove it.
fn predict(model: &Model, drive: &Recording, options: &cli::Simulate) -> Result<Recording, Failure> {
    let zeros = vec![0.0; drive.len()];
    let inputs: Vec<&[f64]> = model.inputs.iter().map(|i| drive.signal(&i.name).unwrap_or(&zeros)).collect();
    let how = Options { substeps: options.substeps, add_noise: options.noise, quantise: options.noise.is_some() };
    let outputs =
        simulate_model(model, &inputs, drive.period, &how).map_err(|e| Failure::input(format!("model \"{}\": {e}", model.name)))?;
    let mut columns: Vec<(String, Vec<f64>)> =
        model.inputs.iter().zip(&inputs).map(|(i, samples)| (i.name.clone(), samples.to_vec())).collect();
    columns.extend(model.outputs.iter().map(|o| o.name.clone()).zip(outputs));
    let diverged = columns.iter().any(|(_, samples)| samples.iter().any(|x| !x.is_finite()));
    if diverged {
        return Err(Failure::input(format!("model \"{}\": its motion grows beyond all bounds on {}", model.name, drive.name)));
    }
    Recording::new(&drive.name, drive.t.clone(), columns).map_err(Failure::input)
}

/// Root mean squared error over the standard deviation of the measured signal, per recorded output.
fn compare(model: &Model, measured: &Recording, predicted: &Recording) -> Vec<(String, f64)> {
    let outputs = model.outputs.iter().filter(|o| !matches!(&o.kind, OutputKind::Force(list) if list.is_empty()));
    outputs
        .filter_map(|output| {
            let (y, p) = (measured.signal(&output.name)?, predicted.signal(&output.name)?);
            let n = y.len() as f64;
            let mean = y.iter().sum::<f64>() / n;
            let spread = y.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
            let error = y.iter().zip(p).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            Some((output.name.clone(), (error / if spread > 0.0 { spread } else { n }).sqrt()))
        })
        .collect()
}
