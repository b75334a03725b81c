//! What a diagnosis found, in one form for every device.

use crate::error::AnswerError;
use crate::opened::{Device, Opened};
use crate::text;
use backdrive_diagnosis::arms::diagnose as arms;
use backdrive_diagnosis::arms::problem::Problem as ArmProblem;
use backdrive_diagnosis::diagnose::{self as one_axis, Diagnosis};
use backdrive_diagnosis::verdict::{EXPERIMENT_FILE, MODEL_FILE, VERDICT_FILE, Verdict, rival_file};
use backdrive_servo::diagnose as servo;
use backdrive_servo::problem::Problem as ServoProblem;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// What was found.
pub struct Found {
    /// All of it, by the kind of the device.
    pub device: Diagnosed,
    /// The set or the recording, for titles.
    pub name: String,
    /// What a reader should know before the results: of the recordings and the options.
    pub notes: Vec<String>,
    /// The files that were read.
    pub read: Vec<PathBuf>,
}

/// What was found, by the kind of the device.
pub enum Diagnosed {
    /// A network of one axis.
    OneAxis(Box<Diagnosis>),
    /// An arm, with its logs.
    Arm(Box<(ArmProblem, arms::Found)>),
    /// Servo joints, with their recordings.
    Servo(Box<(ServoProblem, servo::Found)>),
}

/// Diagnoses. Once `stop` is set it comes to an end with what was found until then; `report` hears what is being done.
///
/// # Errors
/// When a recording is of no use, or the model cannot be computed on it.
pub fn diagnose(opened: Opened, stop: Option<&AtomicBool>, report: &(dyn Fn(&str) + Sync)) -> Result<Found, AnswerError> {
    let Opened { device, options, name, notes, files } = opened;
    let device = match device {
        Device::OneAxis(problem) => {
            let found = one_axis::diagnose(*problem, &options, stop, report).map_err(AnswerError::input)?;
            Diagnosed::OneAxis(Box::new(found))
        }
        Device::Arm(problem) => {
            let found = arms::diagnose(&problem, &options, stop, report).map_err(AnswerError::input)?;
            Diagnosed::Arm(Box::new((*problem, found)))
        }
        Device::Servo(problem) => {
            let found = servo::diagnose(&problem, &options, stop, report).map_err(AnswerError::input)?;
            Diagnosed::Servo(Box::new((*problem, found)))
        }
    };
    Ok(Found { device, name, notes, read: files })
}

impl Found {
    /// The verdict.
    pub fn verdict(&self) -> &Verdict {
        match &self.device {
            Diagnosed::OneAxis(found) => &found.verdict,
            Diagnosed::Arm(both) => &both.1.verdict,
            Diagnosed::Servo(both) => &both.1.verdict,
        }
    }

    /// The files of the answer, each with its name and its text: verdict, diagnosed model, rival models, next experiment.
    ///
    /// # Errors
    /// When the verdict cannot be written as JSON.
    pub fn files(&self) -> Result<Vec<(String, String)>, AnswerError> {
        let json = serde_json::to_string_pretty(self.verdict()).map_err(AnswerError::input)?;
        let mut out = vec![(VERDICT_FILE.to_string(), format!("{json}\n"))];
        match &self.device {
            Diagnosed::OneAxis(found) => {
                out.push((MODEL_FILE.to_string(), found.files.model.clone()));
                let rivals = found.files.rivals.iter().enumerate();
                out.extend(rivals.map(|(index, rival)| (rival_file(index + 1), rival.clone())));
                out.extend(found.files.experiment.iter().map(|text| (EXPERIMENT_FILE.to_string(), text.clone())));
            }
            Diagnosed::Arm(both) => {
                out.push((MODEL_FILE.to_string(), both.1.model.clone()));
                out.push((arms::EXPERIMENT_FILE.to_string(), both.1.experiment.clone()));
            }
            Diagnosed::Servo(both) => out.push((MODEL_FILE.to_string(), both.1.model.to_toml())),
        }
        Ok(out)
    }

    /// What was found in lines for a terminal.
    pub fn text(&self) -> String {
        match &self.device {
            Diagnosed::OneAxis(found) => text::one_axis::text(found),
            Diagnosed::Arm(both) => text::arm::text(&both.0, &both.1),
            Diagnosed::Servo(both) => text::servo::text(&both.0, &both.1),
        }
    }

    /// What the search tried, what it cost and why it lost, as tables.
    pub fn explained(&self) -> String {
        match &self.device {
            Diagnosed::OneAxis(found) => text::search::explained(&found.search),
            Diagnosed::Arm(both) => text::arm::explained(&both.1.tried),
            Diagnosed::Servo(both) => text::servo::explained(&both.0, &both.1),
        }
    }

    /// Notes that stand before the results on a page: the notes before the search, and those of the search.
    pub fn all_notes(&self) -> Vec<&str> {
        let searched: &[String] = match &self.device {
            Diagnosed::OneAxis(_) => &[],
            Diagnosed::Arm(both) => &both.1.notes,
            Diagnosed::Servo(both) => &both.1.notes,
        };
        self.notes.iter().chain(searched).map(String::as_str).collect()
    }
}
