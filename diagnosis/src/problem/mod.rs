//! What a diagnosis starts from: a nominal model, the recordings to fit, the recordings held out, and the parameters that may be wrong.

mod error;
mod files;
mod lag;
mod logged;
mod outliers;
mod record;
mod stated;

pub use error::ProblemError;
pub use logged::Logged;
pub use outliers::Outliers;
pub use record::Record;
pub use stated::Stated;

use crate::noise;
use crate::tuning::tuning;
use crate::unknown::Unknown;
use backdrive_plant::model::Model;
use backdrive_plant::set::{Initial, RecordingSet};
use backdrive_plant::stepper::{Options, Plant, ahead};
use backdrive_plant::tomlfile::read_text;
use files::{names, record, unknown_of};
use lag::lag_of;
use stated::stated_numbers;
use std::path::{Path, PathBuf};

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
    /// Noise standard deviation of each output, in its unit; see [`crate::noise`].
    pub noise_sd: Vec<f64>,
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
        let mut left_out = Vec::new();
        let mut read = |files: &[String]| {
            let mut records = Vec::new();
            for file in files {
                match record(set, file, &model, &unknown) {
                    Ok(record) => records.push(record),
                    // One short file says nothing, and does not keep the others from being diagnosed.
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
        Ok(Problem { text, model_path, model, fit, held_out, stated, initial, unknown: Vec::new(), left_out: Vec::new(), noise_sd, lag })
    }
}
