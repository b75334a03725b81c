//! What is to be explained: a nominal model, recordings to fit and recordings to be kept aside, and the numbers that may be off.

use crate::floor;
use crate::unknown::Unknown;
use backdrive_bags::{BagError, Reader, recording as bag_recording, topic_of};
use backdrive_plant::model::{Hold, InputKind, Model, OutputKind};
use backdrive_plant::recording::{Columns, Jitter, Recording, RecordingError, signals_of};
use backdrive_plant::set::{Condition, Initial, RecordingSet};
use backdrive_plant::stepper::{CompileError, Options, Plant, Segment, ahead, segments};
use backdrive_plant::tomlfile::{FileError, read_text};
use std::path::{Path, PathBuf};

/// Why there is nothing to diagnose.
#[derive(Debug, thiserror::Error)]
pub enum ProblemError {
    /// A file cannot be read, or says something impossible.
    #[error(transparent)]
    File(#[from] FileError),
    /// A bag cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// Samples are no recording of this model.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The nominal model cannot be simulated.
    #[error("the nominal model cannot be simulated: {0}")]
    Model(#[from] CompileError),
    /// The set does not say which model, or names nothing to fit.
    #[error("{0}")]
    Set(String),
}

/// One recording, ready to be simulated and compared.
#[derive(Debug, Clone)]
pub struct Record {
    /// Its file.
    pub name: String,
    /// Sample time, s.
    pub period: f64,
    /// Number of samples.
    pub len: usize,
    /// How regular its clock was before it was put on a grid.
    pub jitter: Jitter,
    /// Samples of each input of the model.
    pub inputs: Vec<Vec<f64>>,
    /// The same as the stepper takes them.
    pub segments: Vec<Vec<Segment>>,
    /// Samples of each output of the model, in the output's unit; `None` where this file has none.
    pub outputs: Vec<Option<Vec<f64>>>,
    /// Standard deviation of each output's samples; 1 where there are none or all are the same.
    pub spread: Vec<f64>,
    /// Parameters with another value in this file.
    pub conditions: Vec<(String, Condition)>,
    /// Bodies that do not start at rest, where it is a part of a recording: body, position in m, velocity in m/s.
    pub begins: Vec<(usize, f64, f64)>,
    /// Samples at its start that do not count, for the same reason.
    pub skip: usize,
    /// Samples of the recording before it, where it is a part of one.
    pub before: usize,
}

/// A number that the nominal file states, and that may be off.
#[derive(Debug, Clone, PartialEq)]
pub struct Stated {
    /// Its path, as [`Model::values_at`] takes it.
    pub path: String,
    /// Its place where the path leads to a list.
    pub index: usize,
    /// What the file says.
    pub given: f64,
    /// Lowest and highest value that a fit may try.
    pub range: (f64, f64),
    /// Whether it is searched in logarithms.
    pub log: bool,
}

/// A nominal model and the recordings that are to be held against it.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The model file's text.
    pub text: String,
    /// Where the model file is.
    pub model_path: PathBuf,
    /// The nominal model.
    pub model: Model,
    /// Recordings that fits see.
    pub fit: Vec<Record>,
    /// Recordings that no fit sees.
    pub held_out: Vec<Record>,
    /// Numbers that may be off.
    pub stated: Vec<Stated>,
    /// How the device starts in each file.
    pub initial: Initial,
    /// Inputs that nobody measured.
    pub unknown: Vec<Unknown>,
    /// Standard deviation of the measuring error of each output, in its unit; see [`floor`].
    pub floor: Vec<f64>,
    /// Samples over which each output's displacement is compared instead of its position; 0 where the position itself is.
    pub lag: Vec<usize>,
}

impl Problem {
    /// Opens a set whose `set.toml` names the model, or which is held against `model`.
    ///
    /// # Errors
    /// When a file is missing or wrong, a signal is not recorded, or the nominal model cannot be simulated.
    pub fn open(set: &Path, model: Option<&Path>) -> Result<Problem, ProblemError> {
        Problem::of_set(&RecordingSet::open(set)?, model)
    }

    /// The same of a set at hand.
    ///
    /// # Errors
    /// As [`Problem::open`].
    pub fn of_set(set: &RecordingSet, model: Option<&Path>) -> Result<Problem, ProblemError> {
        let no_model =
            || ProblemError::Set(format!("{}: no model is named; say model = \"...\" in set.toml or give one", set.folder.display()));
        let model_path = model.map(Path::to_path_buf).or_else(|| set.model.clone()).ok_or_else(no_model)?;
        let text = read_text(&model_path)?;
        Problem::of_text(set, text, model_path)
    }

    /// The same of a set at hand and a model's text; `model_path` is where it would lie.
    ///
    /// # Errors
    /// As [`Problem::open`].
    pub fn of_text(set: &RecordingSet, text: String, model_path: PathBuf) -> Result<Problem, ProblemError> {
        let model = Model::from_toml(&text, &model_path.display().to_string())?;
        set.check_conditions(&model)?;
        let unknown = unknown_of(set, &model)?;
        let read = |files: &[String]| files.iter().map(|file| record(set, file, &model, &unknown)).collect::<Result<Vec<_>, _>>();
        let (fit, held_out) = (read(&set.fit)?, read(&set.held_out)?);
        Ok(Problem { unknown, ..Problem::new(text, model_path, model, fit, held_out, set.initial)? })
    }

    /// The same from recordings at hand.
    ///
    /// # Errors
    /// When there is nothing to fit, no output was recorded, or the nominal model cannot be simulated.
    pub fn new(
        text: String,
        model_path: PathBuf,
        model: Model,
        fit: Vec<Record>,
        held_out: Vec<Record>,
        initial: Initial,
    ) -> Result<Problem, ProblemError> {
        let first = fit.first().ok_or_else(|| ProblemError::Set("there are no recordings to fit".to_string()))?;
        let caught_up = ahead(&model, &first.inputs, first.period);
        Plant::new(caught_up.as_ref().map_or(&model, |(model, _)| model), first.period, &Options::default())?;
        let measured = |output: usize| fit.iter().any(|r| r.outputs.get(output).is_some_and(Option::is_some));
        if !(0..model.outputs.len()).any(measured) {
            return Err(ProblemError::Set(format!(
                "none of the model's outputs ({}) was recorded",
                names(model.outputs.iter().map(|o| o.name.as_str()))
            )));
        }
        let stated = stated_numbers(&model, &text);
        let floor = (0..model.outputs.len()).map(|output| floor::of_signal(&model, &fit, output)).collect();
        let lag = (0..model.outputs.len()).map(|output| lag_of(&model, &fit, output)).collect();
        Ok(Problem { text, model_path, model, fit, held_out, stated, initial, unknown: Vec::new(), floor, lag })
    }
}

fn names<'a>(all: impl Iterator<Item = &'a str>) -> String {
    all.collect::<Vec<_>>().join(", ")
}

/// The inputs that a set says nobody measured.
fn unknown_of(set: &RecordingSet, model: &Model) -> Result<Vec<Unknown>, ProblemError> {
    let one = |(name, bandwidth_hz): &(String, f64)| {
        let place = set.folder.join("set.toml");
        let Some(input) = model.inputs.iter().position(|i| i.name == *name) else {
            let all = names(model.inputs.iter().map(|i| i.name.as_str()));
            return Err(ProblemError::Set(format!("{}, unknown.{name}: the model has no such input; it has {all}", place.display())));
        };
        if set.columns.iter().any(|(signal, _)| signal == name) {
            let place = place.display();
            return Err(ProblemError::Set(format!("{place}, unknown.{name}: has a column too; an input is recorded or unknown")));
        }
        Ok(Unknown { input, bandwidth_hz: *bandwidth_hz })
    };
    set.unknown.iter().map(one).collect()
}

/// Reads one file of a set onto a regular grid.
fn record(set: &RecordingSet, file: &str, model: &Model, unknown: &[Unknown]) -> Result<Record, ProblemError> {
    let path = set.path_of(file);
    let rules = set.rules_of(file);
    let is_bag = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap"));
    let recording = if is_bag { from_bag(&path, model, &set.columns, &rules.piece)? } else { from_csv(&path, model, set, &rules.piece)? };
    recording.check_units(model)?;
    // Pieces of one file have names of their own.
    let name = set.folder.join(file).display().to_string();
    let recording = Recording { name, ..recording };
    Record::knowing(&recording, model, rules.condition, unknown)
}

fn from_csv(path: &Path, model: &Model, set: &RecordingSet, piece: &backdrive_plant::recording::Piece) -> Result<Recording, ProblemError> {
    let nobody_measured = |name: &str| set.unknown.iter().any(|(input, _)| input == name);
    Ok(backdrive_plant::recording::read_signals_of(path, model, &set.columns, piece, &nobody_measured)?)
}

fn from_bag(path: &Path, model: &Model, columns: &Columns, piece: &backdrive_plant::recording::Piece) -> Result<Recording, ProblemError> {
    let reader = Reader::open(path)?;
    let there = |name: &str| columns.iter().any(|(signal, _)| signal == name) || reader.topic(&topic_of(name)).is_ok();
    let wanted: Vec<&str> = signals_of(model).into_iter().filter(|name| there(name)).collect();
    if wanted.is_empty() {
        let asked = names(signals_of(model).into_iter());
        return Err(ProblemError::Set(format!("{}: say in [columns] of set.toml which topics hold {asked}", path.display())));
    }
    let hold = |name: &str| model.inputs.iter().find(|i| i.name == name).map_or(Hold::Linear, |i| i.hold);
    Ok(bag_recording(&reader, Some(&wanted), columns, piece, &hold)?)
}

/// Fewest samples that say anything about a device.
const FEWEST_SAMPLES: usize = 50;

impl Record {
    /// A recording as the model needs it.
    ///
    /// # Errors
    /// When an input is missing, or there are too few samples.
    pub fn new(recording: &Recording, model: &Model, conditions: Vec<(String, Condition)>) -> Result<Record, ProblemError> {
        Record::knowing(recording, model, conditions, &[])
    }

    /// The same where some inputs are unknown: they rest.
    fn knowing(
        recording: &Recording,
        model: &Model,
        conditions: Vec<(String, Condition)>,
        unknown: &[Unknown],
    ) -> Result<Record, ProblemError> {
        let jitter = recording.jitter.clone();
        let recording = recording.regular_for(model)?;
        if recording.len() < FEWEST_SAMPLES {
            let count = recording.len();
            return Err(ProblemError::Set(format!(
                "{}: has {count} samples; a diagnosis needs at least {FEWEST_SAMPLES} per recording",
                recording.name
            )));
        }
        let input = |(index, input): (usize, &backdrive_plant::model::Input)| match unknown.iter().any(|u| u.input == index) {
            true => Ok(vec![0.0; recording.len()]),
            false => recording.need_signal(&input.name).map(<[f64]>::to_vec),
        };
        let inputs: Vec<Vec<f64>> = model.inputs.iter().enumerate().map(input).collect::<Result<_, _>>()?;
        let outputs: Vec<Option<Vec<f64>>> = model.outputs.iter().map(|o| recording.signal(&o.name).map(<[f64]>::to_vec)).collect();
        let period = recording.period;
        let segments = model.inputs.iter().zip(&inputs).map(|(input, samples)| segments(input.hold, samples, period)).collect();
        let spread = outputs.iter().map(|o| o.as_deref().map_or(1.0, spread)).collect();
        let (name, len, begins) = (recording.name.clone(), recording.len(), Vec::new());
        Ok(Record { name, period, len, jitter, inputs, segments, outputs, spread, conditions, begins, skip: 0, before: 0 })
    }

    /// A part of the recording, with the motion that the bodies begin with and the samples that do not count.
    pub fn part(&self, range: std::ops::Range<usize>, begins: Vec<(usize, f64, f64)>, skip: usize) -> Record {
        let of = |samples: &Vec<f64>| samples.get(range.clone()).map(<[f64]>::to_vec).unwrap_or_default();
        Record {
            len: range.len(),
            inputs: self.inputs.iter().map(of).collect(),
            // One fewer than samples where the input runs on from one to the next.
            segments: self
                .segments
                .iter()
                .map(|s| s.get(range.start..range.end.min(s.len())).map(<[Segment]>::to_vec).unwrap_or_default())
                .collect(),
            outputs: self.outputs.iter().map(|o| o.as_ref().map(of)).collect(),
            begins,
            skip,
            before: self.before + range.start,
            ..self.clone()
        }
    }
}

/// Standard deviation; 1 where it is 0.
fn spread(samples: &[f64]) -> f64 {
    let n = samples.len().max(1) as f64;
    let mean = samples.iter().sum::<f64>() / n;
    let variance = samples.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n;
    if variance > 0.0 { variance.sqrt() } else { 1.0 }
}

/// How far a positive number may be off, as a factor.
const FACTOR: f64 = 50.0;

/// Numbers that the file states. Those that are 0 have no scale: what they would add is physics, not a number.
fn stated_numbers(model: &Model, text: &str) -> Vec<Stated> {
    let keys = stated_keys(text);
    let elements_and_bodies = model.parameter_paths().into_iter().filter(|path| {
        // A default that the file does not write is not stated.
        !path.starts_with("elements.") || keys.iter().any(|k| k == path) || keys.iter().all(|k| !k.starts_with("elements."))
    });
    let signals = keys.iter().filter(|k| {
        let key = k.rsplit('.').next().unwrap_or("");
        (k.starts_with("inputs.") && ["gain", "delay", "bandwidth", "saturation", "back_emf"].contains(&key))
            || (k.starts_with("outputs.") && ["gain", "delay", "offset"].contains(&key))
    });
    let mut found = Vec::new();
    for path in elements_and_bodies.chain(signals.cloned()) {
        let Ok(values) = model.values_at(&path) else { continue };
        for (index, given) in values.into_iter().enumerate() {
            if given == 0.0 || !given.is_finite() || is_idle(model, &path) {
                continue;
            }
            let key = path.rsplit('.').next().unwrap_or("");
            // A shape, not a size: moved a little only.
            let factor = if ["exponent", "ratio"].contains(&key) { 2.0 } else { FACTOR };
            let signed = ["phase", "offset", "rest", "gap", "force"].contains(&key) && given < 0.0 || key == "phase";
            let (range, log) = match () {
                () if signed && key == "phase" => ((given - std::f64::consts::PI, given + std::f64::consts::PI), false),
                () if given > 0.0 => ((given / factor, given * factor), true),
                () => ((given - 10.0 * given.abs(), given + 10.0 * given.abs()), false),
            };
            found.push(Stated { path: path.clone(), index, given, range, log });
        }
    }
    found
}

/// Whether a number cannot have any effect: the inertia of a prescribed body whose reaction nobody reads.
fn is_idle(model: &Model, path: &str) -> bool {
    let Some(name) = path.strip_prefix("bodies.") else { return false };
    let Some(body) = model.bodies.iter().position(|b| b.name == name) else { return false };
    let moved = model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == body);
    moved && !model.outputs.iter().any(|o| o.kind == OutputKind::Reaction(body))
}

/// Paths of the keys that the file writes in its elements, inputs and outputs.
fn stated_keys(text: &str) -> Vec<String> {
    let Ok(document) = text.parse::<toml_edit::DocumentMut>() else { return Vec::new() };
    let mut keys = Vec::new();
    for section in ["elements", "inputs", "outputs"] {
        let Some(item) = document.get(section) else { continue };
        let Ok(tables) = item.clone().into_array_of_tables() else { continue };
        for (index, table) in tables.iter().enumerate() {
            let name = table.get("name").and_then(|n| n.as_str()).map_or_else(|| format!("element{index}"), str::to_string);
            keys.extend(table.iter().map(|(key, _)| format!("{section}.{name}.{key}")));
        }
    }
    keys
}

/// A lag for positions that nothing holds back: without a spring to ground, a small wrong force moves them without bounds.
fn lag_of(model: &Model, fit: &[Record], output: usize) -> usize {
    let OutputKind::Position(body) = model.outputs[output].kind else { return 0 };
    if is_held(model, body) {
        return 0;
    }
    let shortest = fit.iter().map(|r| r.len).min().unwrap_or(0);
    (shortest / 150).max(20)
}

/// Whether springs, or what acts like one, tie a body to ground or to a body whose motion is prescribed.
fn is_held(model: &Model, body: usize) -> bool {
    let fixed = |place: Option<usize>| place.is_none_or(|b| model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == b));
    let elastic = ["spring", "cubic_spring", "hysteretic_spring", "bouc_wen", "backlash", "contact", "hunt_crossley"];
    let mut reached = vec![false; model.bodies.len()];
    let mut waiting = vec![body];
    while let Some(at) = waiting.pop() {
        if fixed(Some(at)) {
            return true;
        }
        if std::mem::replace(&mut reached[at], true) {
            continue;
        }
        for element in model.elements.iter().filter(|e| elastic.contains(&e.law.kind().name)) {
            let other = match element.between {
                [Some(a), b] if a == at => b,
                [a, Some(b)] if b == at => a,
                _ => continue,
            };
            match other {
                Some(b) => waiting.push(b),
                None => return true,
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_to_the_very_end_keeps_its_inputs() {
        let text = "name = 'cart'\n[bodies]\ncart = 2.0\n[[inputs]]\nname = 'f'\nkind = 'force'\non = 'cart'\n\
                    [[outputs]]\nname = 'x'\nkind = 'position'\nof = 'cart'\n";
        let model = Model::from_toml(text, "cart.toml").unwrap();
        let t: Vec<f64> = (0..100).map(|i| 0.01 * f64::from(i)).collect();
        let signals = vec![("f".to_string(), t.clone()), ("x".to_string(), t.clone())];
        let record = Record::new(&Recording::new("r", t, signals).unwrap(), &model, Vec::new()).unwrap();
        let part = record.part(60..100, Vec::new(), 0);
        assert_eq!((part.len, part.segments[0].len()), (40, 39));
        assert_eq!(record.part(20..60, Vec::new(), 0).segments[0].len(), 40);
    }
}
