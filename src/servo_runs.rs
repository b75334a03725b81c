//! `simulate` and `fit` of a model whose joints position servos drive.

use crate::failure::Failure;
use crate::model_run::Run;
use crate::output;
use crate::progress;
use backdrive_answers::sentences::estimate;
use backdrive_plant::model::Model;
use backdrive_predict::fit::Options as Fitting;
use backdrive_predict::servos::{JointError, ServoRuns};
use backdrive_predict::simulate::Options;
use backdrive_report::number;
use backdrive_servo::problem::Problem;
use backdrive_servo::refit::{Fitted, Refitted, refit};
use backdrive_sets::open;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Runs the joints of the model in the file `path` from the commands of recordings; `each` takes each run, with its difference from the recorded positions.
///
/// # Errors
/// A recording cannot be read or has no joint of the model, or an error of `may_write` and `each`.
pub fn simulate(
    path: &Path,
    options: &Options,
    model: &Model,
    may_write: &dyn Fn(&Path) -> Result<(), Failure>,
    each: &mut dyn FnMut(Run) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let servos = progress::busy(&format!("reading {}", options.drive), || ServoRuns::read(options, path, model))?;
    for run in &servos.runs {
        let (file, out) = (&run.file, &run.out);
        may_write(out)?;
        let found = servos.predict(run)?;
        let samples = found.recording.len();
        let line = |joint: &JointError| {
            let nrmse = joint.nrmse.map_or("-".to_string(), |s| format!("{s:.4}"));
            format!("  {:<24} nrmse {nrmse}, mean error {} mrad", joint.joint, number(1e3 * joint.mean_rad))
        };
        let mut lines = vec![format!("{file} -> {}: {samples} samples, free run from the commands", out.display())];
        lines.extend(found.joints.iter().map(line));
        let error = |j: &JointError| (j.joint.clone(), json!({ "nrmse": j.nrmse, "mean_error_rad": j.mean_rad }));
        let joints: serde_json::Map<_, _> = found.joints.iter().map(error).collect();
        let json = json!({ "recording": file, "out": out, "samples": samples, "joints": joints });
        each(Run { recording: found.recording, out: out.clone(), lines, json })?;
    }
    Ok(())
}

/// The parameters that the model states of each joint refitted, its structure unchanged.
pub struct ServoRefit {
    name: String,
    fitted: Fitted,
}

impl ServoRefit {
    /// Refits. `out` is a file that the caller writes afterwards.
    ///
    /// # Errors
    /// A file is missing or wrong, no joint of the model was recorded, or `out` is a file that is read.
    pub fn of(asked: &Fitting, out: Option<&Path>, overwrite: bool) -> Result<ServoRefit, Failure> {
        let (mut set, told) = open::set_of(&asked.set)?;
        let mut notes = Vec::new();
        open::hold_out(&mut set, told, &mut notes);
        notes.iter().for_each(|note| output::note(format_args!("note: {note}")));
        if let Some(out) = out {
            let files: Vec<PathBuf> = std::iter::once(asked.model.clone()).chain(set.paths()).collect();
            open::not_onto(out, &files, overwrite)?;
        }
        let problem = progress::busy("reading the recordings", || Problem::open(&set, Some(&asked.model))).map_err(Failure::input)?;
        let fitted = progress::busy("fitting the servo joints", || refit(&problem)).map_err(Failure::input)?;
        Ok(ServoRefit { name: problem.model.name, fitted })
    }

    /// The text of the refitted model's file.
    pub fn model(&self) -> String {
        self.fitted.model.to_toml()
    }

    /// The result for programs.
    pub fn json(&self) -> Value {
        let joint = |j: &Refitted| (j.joint.clone(), json!({ "numbers": j.numbers, "given": j.given, "fitted": j.fitted }));
        let joints: serde_json::Map<_, _> = self.fitted.joints.iter().map(joint).collect();
        json!({ "model": self.name, "joints": joints })
    }

    /// Prints the joints, and where the model was written.
    ///
    /// # Errors
    /// Standard output cannot be written.
    pub fn told(&self, out: Option<&Path>) -> Result<(), Failure> {
        self.fitted.joints.iter().try_for_each(told_of)?;
        out.map_or(Ok(()), |out| output::line(format_args!("wrote     {}", out.display())))
    }
}

fn told_of(joint: &Refitted) -> Result<(), Failure> {
    let share = |x: Option<f64>| x.map_or("-".to_string(), |x| format!("{x:.4}"));
    output::line(format_args!("{}: free run nrmse {} as given, {} fitted", joint.joint, share(joint.given), share(joint.fitted)))?;
    for (key, value) in &joint.numbers {
        output::line(format_args!("  {:<22} {}", key.replace('_', " "), estimate(value)))?;
    }
    Ok(())
}
