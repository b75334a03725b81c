//! A model run on recordings or on an excitation.

use crate::error::PredictError;
use backdrive_bags::{Reader, recording, topic_of};
use backdrive_plant::excitation::{Excitation, load_experiments};
use backdrive_plant::model::{Hold, Model, OutputKind};
use backdrive_plant::recording::{Columns, Piece, Recording, TableSource, signals_of};
use backdrive_plant::robot::Payload;
use backdrive_plant::set::{Condition, RecordingSet};
use backdrive_plant::stepper;
use std::fmt::{self, Display, Formatter};
use std::path::{Component, Path, PathBuf};

/// What a model is run on, and how.
#[derive(Debug, Clone)]
pub struct Options {
    /// What drives it.
    pub drive: Driver,
    /// Where the prediction goes: a file, for several a folder.
    pub out: PathBuf,
    /// Which input an excitation drives; `None` for the first.
    pub input: Option<String>,
    /// Samples per second of an excitation.
    pub rate: f64,
    /// Substeps of each sample; `None` for a count that suits the model.
    pub substeps: Option<usize>,
    /// Seed of the sensors' noise, which with their rounding is added where there is one.
    pub noise: Option<u64>,
    /// A set.toml whose `[columns]` are used.
    pub columns: Option<PathBuf>,
}

/// What drives a model.
#[derive(Debug, Clone)]
pub enum Driver {
    /// A recording (CSV or bag), a folder with a set.toml, an excitation file, or an excitation such as `steps:amplitude=1,duration=2`.
    Named(String),
    /// The recordings of a set that a program states.
    Set(Box<RecordingSet>),
}

impl Display for Driver {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Driver::Named(name) => f.write_str(name),
            Driver::Set(set) => f.write_str(set.fit.iter().chain(&set.held_out).next().map_or("no recording", String::as_str)),
        }
    }
}

/// What drives the model, where its prediction goes, and what is different in this experiment.
pub struct Drive {
    /// The inputs, and the outputs that were recorded.
    pub recording: Recording,
    /// File of the prediction.
    pub out: PathBuf,
    condition: Vec<(String, Condition)>,
    payload: Option<Payload>,
}

/// What a model predicts.
pub struct Prediction {
    /// Inputs and predicted outputs.
    pub recording: Recording,
    /// Of each output that was recorded: root mean squared error over the standard deviation of what was measured.
    pub nrmse: Vec<(String, f64)>,
    /// What a person should know of it: a sentence each.
    pub notes: Vec<String>,
}

impl Drive {
    /// Simulates the model under the conditions of this experiment. What is to be estimated there keeps its number.
    ///
    /// # Errors
    /// A condition or a payload does not suit the model, or its motion grows beyond all bounds.
    pub fn predict(&self, model: &Model, options: &Options) -> Result<Prediction, PredictError> {
        let mut notes = Vec::new();
        let model = self.conditioned(model, &mut notes)?;
        let recording = predict(&model, &self.recording, options)?;
        Ok(Prediction { nrmse: compare(&model, &self.recording, &recording), recording, notes })
    }

    fn conditioned(&self, model: &Model, notes: &mut Vec<String>) -> Result<Model, PredictError> {
        let (mut model, recording) = (model.clone(), &self.recording.name);
        if let (Some(payload), Some(arm)) = (&self.payload, &model.arm) {
            let arm = arm.carrying(payload).map_err(|e| PredictError::input(format!("{recording}: payload: {e}")))?;
            model.arm = Some(Box::new(arm));
        }
        for (path, value) in &self.condition {
            match value {
                Condition::Value(value) => {
                    model.set_values_at(path, &[*value]).map_err(|e| PredictError::input(format!("{recording}: condition {path}: {e}")))?
                }
                Condition::Free | Condition::Shared(_) => {
                    notes.push(format!("{recording}: {path} is free in this file; the model's value is used"));
                }
            }
        }
        Ok(model)
    }
}

/// What drives the model, and where each prediction goes.
///
/// # Errors
/// The recording, the set or the excitation cannot be read, or does not suit the model.
pub fn drives(options: &Options, model: &Model) -> Result<Vec<Drive>, PredictError> {
    let named = match &options.drive {
        Driver::Named(named) => named,
        Driver::Set(set) => return of_set(set, model, &options.out, set.fit.len() + set.held_out.len() == 1),
    };
    let path = Path::new(named);
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let columns = match &options.columns {
        Some(set) => RecordingSet::open(set)?.columns,
        None => Columns::new(),
    };
    if path.is_dir() || path.file_name().is_some_and(|n| n == "set.toml") {
        return of_set(&RecordingSet::open(path)?, model, &options.out, false);
    }
    if extension == "csv" || extension == "mcap" {
        let recording = match extension.as_str() {
            "mcap" => from_bag(path, model, &columns, &Piece::default())?,
            _ => from_table(&TableSource::File(path.to_path_buf()), model, &columns, &Piece::default())?,
        };
        let recording = checked(recording, model, &path.display().to_string())?;
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
    let excitation: Excitation = named.parse().map_err(|e| {
        PredictError::input(format!("{e}; it is not a recording either: those end in .csv or .mcap, or are a folder with a set.toml"))
    })?;
    let drive = [(options.input.clone(), excitation)];
    Ok(vec![Drive { recording: excited(model, named, &drive, options)?, out: options.out.clone(), condition: Vec::new(), payload: None }])
}

/// The recordings of a set, each with the conditions of its file. `out` is the file of the prediction of a single one, else a folder.
fn of_set(set: &RecordingSet, model: &Model, out: &Path, is_single: bool) -> Result<Vec<Drive>, PredictError> {
    set.check_conditions(model)?;
    let one = |file: &String| {
        let rules = set.rules_of(file);
        let recording = match set.is_bag(file) {
            true => from_bag(&set.path_of(file), model, &set.columns, &rules.piece)?,
            false => from_table(&set.table(file), model, &set.columns, &rules.piece)?,
        };
        let recording = checked(recording, model, &set.table(file).name())?;
        // A recording outside the folder is simulated into the folder all the same, and not onto itself.
        let path = Path::new(file);
        let inside = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        let name = if inside { path } else { Path::new(path.file_name().unwrap_or_default()) };
        let out = if is_single { out.to_path_buf() } else { out.join(name.with_extension("csv")) };
        Ok(Drive { recording, out, condition: rules.condition, payload: rules.payload })
    };
    set.fit.iter().chain(&set.held_out).map(one).collect()
}

/// Whether an input is the motion of a hand, which recordings need not hold.
fn is_hand(name: &str) -> bool {
    name.ends_with(".hand")
}

/// The signals of a model from a table.
fn from_table(table: &TableSource, model: &Model, columns: &Columns, piece: &Piece) -> Result<Recording, PredictError> {
    Ok(table.read_signals_of(model, columns, piece, &is_hand)?)
}

/// A recording that holds all inputs of a model, in units that suit it; `name` is where it was read.
fn checked(recording: Recording, model: &Model, name: &str) -> Result<Recording, PredictError> {
    for input in &model.inputs {
        if recording.signal(&input.name).is_none() && !is_hand(&input.name) {
            let there: Vec<&str> = recording.signals.iter().map(|(name, _)| name.as_str()).collect();
            let there = if there.is_empty() { "nothing else".to_string() } else { there.join(", ") };
            return Err(PredictError::input(format!(
                "{name}: has no signal \"{}\", which drives the model; it has {there}; name the column in [columns]",
                input.name
            )));
        }
    }
    recording.check_units(model).map_err(PredictError::input)?;
    recording.regular_for(model).map_err(PredictError::input)
}

fn from_bag(path: &Path, model: &Model, columns: &Columns, piece: &Piece) -> Result<Recording, PredictError> {
    let reader = Reader::open_begun(path).map_err(PredictError::input)?;
    let there = |name: &str| columns.iter().any(|(signal, _)| signal == name) || reader.topic(&topic_of(name)).is_ok();
    let wanted: Vec<&str> = signals_of(model).into_iter().filter(|name| there(name)).collect();
    if wanted.is_empty() {
        let topics: Vec<&str> = reader.topics().iter().map(|t| t.name.as_str()).collect();
        return Err(PredictError::input(format!(
            "{}: state in [columns] of a set.toml which topics hold {}; the bag has {}",
            path.display(),
            signals_of(model).join(", "),
            topics.join(", ")
        )));
    }
    let hold = |name: &str| model.inputs.iter().find(|i| i.name == name).map_or(Hold::Linear, |i| i.hold);
    recording(&reader, Some(&wanted), columns, piece, &hold).map_err(PredictError::input)
}

/// A recording of inputs only, made from excitations.
fn excited(model: &Model, name: &str, drives: &[(Option<String>, Excitation)], options: &Options) -> Result<Recording, PredictError> {
    if !(options.rate.is_finite() && options.rate > 0.0) {
        return Err(PredictError::Usage(format!("--rate must be above 0, is {}", options.rate)));
    }
    let mut inputs: Vec<(String, Vec<f64>)> = Vec::new();
    for (input, excitation) in drives {
        let target = match input {
            Some(name) => model.inputs.iter().find(|i| i.name == *name).ok_or_else(|| {
                let known = model.inputs.iter().map(|i| i.name.as_str());
                PredictError::input(backdrive_plant::tomlfile::unknown("input", name, known))
            })?,
            None => model.inputs.first().ok_or_else(|| PredictError::input(format!("model \"{}\" has no input to drive", model.name)))?,
        };
        inputs.push((target.name.clone(), excitation.samples(options.rate).map_err(PredictError::input)?));
    }
    let longest = inputs.iter().map(|(_, samples)| samples.len()).max().unwrap_or(0);
    inputs.iter_mut().for_each(|(_, samples)| samples.resize(longest, 0.0));
    for input in &model.inputs {
        if !inputs.iter().any(|(name, _)| *name == input.name) {
            inputs.push((input.name.clone(), vec![0.0; longest]));
        }
    }
    let t = (0..longest).map(|i| i as f64 / options.rate).collect();
    Recording::new(name, t, inputs).map_err(PredictError::input)
}

/// The model's outputs beside the inputs that drove it.
fn predict(model: &Model, drive: &Recording, options: &Options) -> Result<Recording, PredictError> {
    let zeros = vec![0.0; drive.len()];
    let inputs: Vec<&[f64]> = model.inputs.iter().map(|i| drive.signal(&i.name).unwrap_or(&zeros)).collect();
    let how = stepper::Options { substeps: options.substeps, add_noise: options.noise, quantise: options.noise.is_some() };
    let outputs =
        stepper::simulate(model, &inputs, drive.period, &how).map_err(|e| PredictError::input(format!("model \"{}\": {e}", model.name)))?;
    let mut columns: Vec<(String, Vec<f64>)> =
        model.inputs.iter().zip(&inputs).map(|(i, samples)| (i.name.clone(), samples.to_vec())).collect();
    columns.extend(model.outputs.iter().map(|o| o.name.clone()).zip(outputs));
    let diverged = columns.iter().any(|(_, samples)| samples.iter().any(|x| !x.is_finite()));
    if diverged {
        return Err(PredictError::input(format!("model \"{}\": its motion diverges on {}", model.name, drive.name)));
    }
    Recording::new(&drive.name, drive.t.clone(), columns).map_err(PredictError::input)
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
