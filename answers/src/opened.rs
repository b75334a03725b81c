//! A question with its model and its recordings, read and checked.

use crate::asked::Asked;
use crate::checks::{of_arm, of_servo, refuse_of_one_axis, refuse_wrong};
use crate::error::AnswerError;
use backdrive_diagnosis::arms::diagnose::EXPERIMENT_FILE as MOTION_FILE;
use backdrive_diagnosis::arms::problem::Problem as ArmProblem;
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::recordings::problem::Problem;
use backdrive_diagnosis::verdict::{EXPERIMENT_FILE, MODEL_FILE};
use backdrive_plant::model::Model;
use backdrive_plant::set::RecordingSet;
use backdrive_servo::problem::{Problem as ServoProblem, is_servo};
use backdrive_sets::{checks, open};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A question that can be answered.
pub struct Opened {
    /// The device: model and recordings.
    pub device: Device,
    /// How to search.
    pub options: Options,
    /// The set or the recording, for titles.
    pub name: String,
    /// What a reader should know before the results.
    pub notes: Vec<String>,
    /// The files that were read: the model, the grip, the recordings.
    pub files: Vec<PathBuf>,
}

/// A device with its recordings, by its kind.
pub enum Device {
    /// A network of one axis.
    OneAxis(Box<Problem>),
    /// A model with `[robot]`, by position and torque of every joint.
    Arm(Box<ArmProblem>),
    /// Joints that position servos drive, by commands and positions.
    Servo(Box<ServoProblem>),
}

impl Opened {
    /// About how long the search takes at most as a rule; `None` where that is not known.
    pub fn expected(&self) -> Option<Duration> {
        match self.device {
            Device::OneAxis(_) => Some(self.options.expected()),
            Device::Arm(_) | Device::Servo(_) => None,
        }
    }

    /// Names of files of the answer that may be those of a file that was read, were the answer written into its folder.
    pub fn may_write(&self) -> Vec<&'static str> {
        match self.device {
            Device::OneAxis(_) => vec![MODEL_FILE, EXPERIMENT_FILE],
            Device::Arm(_) => vec![MODEL_FILE, MOTION_FILE],
            Device::Servo(_) => vec![MODEL_FILE],
        }
    }
}

/// Opens a question. The recordings decide whether the device is servo joints: commands and no torque. Else the model does: one with a robot is an arm.
///
/// # Errors
/// When a file is missing or wrong, the recordings do not suit the model, or an option cannot be taken into account for this device.
pub fn open(asked: &Asked) -> Result<Opened, AnswerError> {
    refuse_wrong(asked)?;
    let (set, is_stated) = open::set_of(&asked.set).map_err(AnswerError::input)?;
    let model = asked.model.clone().or_else(|| set.model.clone());
    if is_servo(&set) {
        return servo(asked, set, is_stated, model);
    }
    match model {
        Some(model) if Model::load(&model).map_err(AnswerError::input)?.arm.is_some() => arm(asked, set, is_stated, model),
        _ => one_axis(asked),
    }
}

fn one_axis(asked: &Asked) -> Result<Opened, AnswerError> {
    refuse_of_one_axis(asked)?;
    let opened = open::open(&asked.set, asked.model.as_deref(), asked.grip.as_deref(), &asked.ignore_signal).map_err(AnswerError::input)?;
    let open::Opened { problem, name, notes, files } = opened;
    Ok(Opened { device: Device::OneAxis(Box::new(problem)), options: asked.options.clone(), name, notes, files })
}

fn arm(asked: &Asked, mut set: RecordingSet, is_stated: bool, model: PathBuf) -> Result<Opened, AnswerError> {
    let mut notes = Vec::new();
    open::hold_out(&mut set, is_stated, &mut notes);
    notes.extend(of_arm(asked, &set)?);
    let problem = ArmProblem::open(&set, Some(&model)).map_err(AnswerError::input)?;
    Ok(opened(asked, Device::Arm(Box::new(problem)), &set, Some(&model), notes))
}

fn servo(asked: &Asked, mut set: RecordingSet, is_stated: bool, model: Option<PathBuf>) -> Result<Opened, AnswerError> {
    let mut notes = checks::repeated(&set).map_err(AnswerError::input)?;
    open::hold_out(&mut set, is_stated, &mut notes);
    notes.extend(of_servo(asked)?);
    let problem = ServoProblem::open(&set, model.as_deref()).map_err(AnswerError::input)?;
    Ok(opened(asked, Device::Servo(Box::new(problem)), &set, model.as_deref(), notes))
}

fn opened(asked: &Asked, device: Device, set: &RecordingSet, model: Option<&Path>, notes: Vec<String>) -> Opened {
    let files = model.map(Path::to_path_buf).into_iter().chain(set.paths()).collect();
    Opened { device, options: asked.options.clone(), name: asked.set.name(), notes, files }
}
