//! What a diagnosis starts from: a nominal model, the recordings to fit, the recordings held out, and the parameters that may be wrong.

mod error;
mod files;
mod lag;
mod logged;
mod outliers;
mod record;
mod stated;
mod substeps;

pub use error::ProblemError;
pub use files::MOST_OF_A_BAG;
pub use logged::Logged;
pub use outliers::Outliers;
pub use record::Record;
pub(crate) use record::spread;
pub use stated::Stated;

use crate::hypothesis::Place;
use crate::recordings::noise;
use crate::recordings::unknown::Unknown;
use crate::tuning::tuning;
use backdrive_plant::model::{InputKind, Model};
use backdrive_plant::set::{Initial, RecordingSet};
use backdrive_plant::stepper::{Options, Plant, ahead};
use backdrive_plant::tomlfile::read_text;
use backdrive_plant::write::{Edit, Value};
use files::{names, record, unknown_of};
use lag::lag_of;
use stated::stated_numbers;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A nominal model and the recordings that are to be held against it.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The model file's text.
    pub text: String,
    /// Where the model file is.
    pub model_path: PathBuf,
    /// The nominal model.
    pub model: Model,
    /// Recordings that are fitted.
    pub fit: Vec<Record>,
    /// Recordings that are held out from every fit.
    pub held_out: Vec<Record>,
    /// Parameters that the model file states and that may be wrong.
    pub stated: Vec<Stated>,
    /// How the device starts in each file.
    pub initial: Initial,
    /// Inputs that were not measured.
    pub unknown: Vec<Unknown>,
    /// Recordings that are too short and were left out: file and samples.
    pub left_out: Vec<(String, usize)>,
    /// Noise standard deviation of each output, in its unit; see [`crate::recordings::noise`].
    pub noise_sd: Vec<f64>,
    /// Its signals, where it is a device driven by forces that was turned round; see [`crate::equation_error`].
    pub inverse: Option<Inverse>,
    /// Samples over which each output's displacement is compared instead of its position; 0 where the position itself is.
    pub lag: Vec<usize>,
}

impl Problem {
    /// Whether a place is an input that nobody measured: what happens to such a signal on its way is part of what is fitted as the signal itself.
    pub fn is_unmeasured(&self, place: &Place) -> bool {
        let names = self.unknown.iter().filter_map(|unknown| self.model.inputs.get(unknown.input)).map(|input| &input.name);
        matches!(place, Place::Signal(signal) if names.into_iter().any(|name| name == signal))
    }

    /// Whether the model has a position that no spring holds: an error of its force then moves it ever farther away.
    pub fn drifts(&self) -> bool {
        self.lag.iter().any(|lag| *lag > 0)
    }

    /// Bodies that a measured motion of zero holds still in all recordings: a law between such a body and another does what it does between that one and the
    /// ground.
    pub fn standing_bodies(&self) -> Vec<&str> {
        let is_unknown = |input: usize| self.unknown.iter().any(|unknown| unknown.input == input);
        let is_still =
            |input: usize| self.fit.iter().chain(&self.held_out).all(|r| r.inputs.get(input).is_some_and(|v| v.iter().all(|x| *x == 0.0)));
        let driven = self
            .model
            .inputs
            .iter()
            .enumerate()
            .filter(|(index, input)| input.kind == InputKind::Motion && !is_unknown(*index) && is_still(*index));
        driven.filter_map(|(_, input)| Some(self.model.bodies.get(input.on)?.name.as_str())).collect()
    }

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
        let mut left_out = Vec::new();
        let mut read = |files: &[String]| {
            let mut records = Vec::new();
            for file in files {
                match record(set, file, &model, &unknown) {
                    Ok(record) => records.push(record),
                    // One short file carries no information, and does not keep the others from being diagnosed.
                    Err(ProblemError::Short { name, count, .. }) => left_out.push((name, count)),
                    Err(error) => return Err(error),
                }
            }
            Ok(records)
        };
        let (fit, held_out) = (read(&set.fit)?, read(&set.held_out)?);
        if let (true, Some((name, count))) = (fit.is_empty(), left_out.first()) {
            return Err(ProblemError::Short { name: name.clone(), count: *count, fewest: tuning().recordings.fewest_samples });
        }
        Ok(Problem { unknown, left_out, ..Problem::new(text, model_path, model, fit, held_out, set.initial)? })
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
        let noise_sd = (0..model.outputs.len()).map(|output| noise::of_signal(&model, &fit, output)).collect();
        let lag = (0..model.outputs.len()).map(|output| lag_of(&model, &fit, output)).collect();
        let (unknown, left_out) = (Vec::new(), Vec::new());
        Ok(Problem { text, model_path, model, fit, held_out, stated, initial, unknown, left_out, noise_sd, inverse: None, lag })
    }

    /// The same without the outputs that stand at one value throughout while another moves. A sensor that is dead or at its rail carries no information on
    /// the device, and has no noise to normalise a residual. Also the names of the omitted outputs.
    pub fn without_dead_outputs(self) -> (Problem, Vec<String>) {
        let is_still = |output: usize| {
            // The same value in all of them: a device may also stand still in each recording, at another position in the next.
            let mut samples = self.fit.iter().chain(&self.held_out).filter_map(|r| r.compared(output)).flatten();
            samples.next().is_some_and(|first| samples.all(|x| x == first))
        };
        let (still, moving): (Vec<usize>, Vec<usize>) = (0..self.model.outputs.len())
            .filter(|output| self.fit.iter().any(|r| r.outputs.get(*output).is_some_and(Option::is_some)))
            .partition(|output| is_still(*output));
        if still.is_empty() || moving.is_empty() {
            return (self, Vec::new());
        }
        let names = still.iter().map(|output| self.model.outputs[*output].name.clone()).collect();
        (self.without_outputs(&still), names)
    }

    /// The same without the outputs of these names.
    ///
    /// # Errors
    /// One sentence where none would be left.
    pub fn without_named_outputs(self, is_ignored: impl Fn(&str) -> bool) -> Result<Problem, String> {
        let measured = |output: &usize| self.fit.iter().any(|r| r.outputs.get(*output).is_some_and(Option::is_some));
        let (ignored, left): (Vec<usize>, Vec<usize>) =
            (0..self.model.outputs.len()).filter(measured).partition(|output| is_ignored(&self.model.outputs[*output].name));
        if ignored.is_empty() {
            return Ok(self);
        }
        if left.is_empty() {
            return Err("every output that was recorded is ignored: there is no signal to compare the model with".to_string());
        }
        Ok(self.without_outputs(&ignored))
    }

    /// The same without some outputs, by their places in the model.
    pub fn without_outputs(self, places: &[usize]) -> Problem {
        let without = |records: Vec<Record>| -> Vec<Record> { records.into_iter().map(|record| record.without_outputs(places)).collect() };
        Problem { fit: without(self.fit), held_out: without(self.held_out), ..self }
    }
}

/// What a problem that was turned round is of.
#[derive(Debug, Clone)]
pub struct Inverse {
    /// The problem before it was inverted.
    pub recorded: Arc<Problem>,
    /// The output that is now the motion.
    pub motion: String,
    /// The input that is now compared; the first where several forces act on the body.
    pub force: String,
}

impl Inverse {
    /// Edits of the inverted model, converted to edits of the model in its file. A motion that is ahead of its recording is a force that acts late. The
    /// opposite case cannot occur in a model of a device that is driven by forces.
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

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_plant::recording::Recording;

    #[test]
    fn a_sensor_at_its_rail_is_left_out_and_a_lone_one_is_not() {
        let text = "name = 'cart'\n[bodies]\ncart = 2.0\n[[inputs]]\nname = 'f'\nkind = 'force'\non = 'cart'\n\
                    [[outputs]]\nname = 'x'\nkind = 'position'\nof = 'cart'\n[[outputs]]\nname = 'v'\nkind = 'velocity'\nof = 'cart'\n";
        let model = Model::from_toml(text, "cart.toml").unwrap();
        let problem = |x: &dyn Fn(f64) -> f64, rails: [f64; 2]| {
            let t: Vec<f64> = (0..200).map(|i| 0.01 * f64::from(i)).collect();
            let record = |rail: f64| {
                let signals = vec![
                    ("f".to_string(), t.clone()),
                    ("x".to_string(), t.iter().map(|t| x(*t)).collect()),
                    ("v".to_string(), vec![rail; 200]),
                ];
                Record::new(&Recording::new("r", t.clone(), signals).unwrap(), &model, Vec::new()).unwrap()
            };
            let [fit, held_out] = rails.map(record);
            Problem::new(text.to_string(), "cart.toml".into(), model.clone(), vec![fit], vec![held_out], Initial::Rest).unwrap()
        };
        let (left, dead) = problem(&|t| t * t, [9.999847; 2]).without_dead_outputs();
        assert_eq!(dead, ["v"]);
        assert!(left.fit.iter().chain(&left.held_out).all(|r| r.outputs[0].is_some() && r.outputs[1].is_none()));
        // Still in each recording, and at another position in the next, is no rail.
        assert!(problem(&|t| t * t, [1.0, 2.0]).without_dead_outputs().1.is_empty());
        // An effect on the way of a signal that nobody measured is part of what is fitted as that signal.
        let mut unmeasured = problem(&|t| t * t, [1.0, 2.0]);
        assert!(!unmeasured.is_unmeasured(&Place::Signal("f".to_string())));
        unmeasured.unknown = vec![Unknown { input: 0, bandwidth_hz: 2.0 }];
        assert!(unmeasured.is_unmeasured(&Place::Signal("f".to_string())) && !unmeasured.is_unmeasured(&Place::Signal("x".to_string())));
        // Where nothing moves the device may be stuck, and the audit reports that.
        let (left, dead) = problem(&|_| 0.0, [9.999847; 2]).without_dead_outputs();
        assert!(dead.is_empty() && left.fit[0].outputs[1].is_some());
    }
}
