//! Joints that position servos drive, run from the commands of recordings.

use crate::error::PredictError;
use crate::simulate::{Driver, Options};
use backdrive_plant::model::Model;
use backdrive_plant::recording::Recording;
use backdrive_plant::servo::Numbers;
use backdrive_plant::set::RecordingSet;
use backdrive_servo::problem::Problem;
use backdrive_servo::run::free_runs;
use backdrive_servo::search::scored;
use backdrive_sets::open;
use backdrive_signal::statistics::deviation;
use std::path::{Path, PathBuf};

/// Recordings of joints whose commands are run.
pub struct ServoRuns {
    /// Each of them.
    pub runs: Vec<Run>,
    problem: Problem,
}

/// One of them.
pub struct Run {
    /// The file, as its set names it.
    pub file: String,
    /// File of the prediction.
    pub out: PathBuf,
    held_out: bool,
    index: usize,
}

/// What the model predicts of one of them.
pub struct Prediction {
    /// Command and simulated position of each joint, rad.
    pub recording: Recording,
    /// How far each joint is from the recorded one.
    pub joints: Vec<JointError>,
}

/// How far a simulated joint is from the recorded one.
pub struct JointError {
    /// Its name.
    pub joint: String,
    /// Root mean squared error over the standard deviation of the position; `None` of a joint that rests.
    pub nrmse: Option<f64>,
    /// Mean absolute error, rad.
    pub mean_rad: f64,
}

impl ServoRuns {
    /// Reads the recordings of joints of a model, which is in the file `path`.
    ///
    /// # Errors
    /// A recording cannot be read, or none has a joint of the model.
    pub fn read(options: &Options, path: &Path, model: &Model) -> Result<ServoRuns, PredictError> {
        let (mut set, is_single) = match &options.drive {
            Driver::Named(named) => {
                let path = Path::new(named);
                let is_set = path.extension().is_none_or(|e| e.eq_ignore_ascii_case("toml"));
                (open::set_of(&path.into())?.0, path.is_file() && !is_set)
            }
            Driver::Set(set) => (set.as_ref().clone(), set.fit.len() + set.held_out.len() == 1),
        };
        if let Some(columns) = &options.columns {
            let other = RecordingSet::open(columns)?;
            (set.columns, set.joints) = (other.columns, other.joints);
        }
        let problem = Problem::open(&set, Some(path))?;
        if stated(&problem).iter().all(Option::is_none) {
            let names: Vec<&str> = model.servos.iter().map(|s| s.joint.as_str()).collect();
            return Err(PredictError::input(format!(
                "{}: contains no joint for which {} has a [servo]; it has {}",
                options.drive,
                path.display(),
                names.join(", ")
            )));
        }
        let out = |file: &str| match is_single {
            true => options.out.clone(),
            false => options.out.join(Path::new(Path::new(file).file_name().unwrap_or_default()).with_extension("csv")),
        };
        let one = |held_out| move |(index, file): (usize, &String)| (held_out, index, file.clone());
        let all = set.fit.iter().enumerate().map(one(false)).chain(set.held_out.iter().enumerate().map(one(true)));
        let runs = all.map(|(held_out, index, file)| Run { out: out(&file), file, held_out, index }).collect();
        Ok(ServoRuns { runs, problem })
    }

    /// Runs the joints freely from the commands of one recording.
    ///
    /// # Errors
    /// The joints cannot be simulated.
    pub fn predict(&self, run: &Run) -> Result<Prediction, PredictError> {
        let positions = free_runs(&self.problem, &stated(&self.problem), run.held_out, run.index)?;
        let (mut signals, mut joints, mut times) = (Vec::new(), Vec::new(), Vec::new());
        for (joint, simulated) in self.problem.joints.iter().zip(&positions).filter(|(j, _)| j.given.is_some()) {
            let record = if run.held_out { &joint.held_out[run.index] } else { &joint.fit[run.index] };
            times.clone_from(&record.t);
            signals.push((format!("{}.command", joint.name), record.command.clone()));
            signals.push((format!("{}.position", joint.name), simulated.clone()));
            let (share, mean_rad) = scored(simulated, &record.position);
            let nrmse = (deviation(&record.position) > 1e-6).then_some(share);
            joints.push(JointError { joint: joint.name.clone(), nrmse, mean_rad });
        }
        Ok(Prediction { recording: Recording::new(&run.file, times, signals)?, joints })
    }
}

/// The parameters that the model states of each joint of the problem.
fn stated(problem: &Problem) -> Vec<Option<Numbers>> {
    problem.joints.iter().map(|j| j.given).collect()
}
