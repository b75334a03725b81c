//! Recordings and the model that they are held against, as `diagnose` and `fit` are given them.

use crate::checks;
use crate::error::SetError;
use crate::recordings::Recordings;
use backdrive_bags::{Account, Reader, import_command, recover_command};
use backdrive_diagnosis::audit;
use backdrive_diagnosis::recordings::problem::{MOST_OF_A_BAG, Problem, ProblemError};
use backdrive_plant::model::{Fragment, Model};
use backdrive_plant::recording::RecordingError;
use backdrive_plant::set::RecordingSet;
use std::path::{Path, PathBuf};

/// What was opened.
pub struct Opened {
    /// The model and its recordings.
    pub problem: Problem,
    /// The set or the recording, for titles.
    pub name: String,
    /// What a reader should know before the results.
    pub notes: Vec<String>,
    /// The files that were read: the model, the grip, the recordings.
    pub files: Vec<PathBuf>,
}

/// Opens a set, a folder of recordings, or recordings. Where nothing states what is held out, the last of several recordings is.
/// A grip is put on the axes of the model; `none` is no hand. `ignored` are recorded inputs that may be left out.
///
/// # Errors
/// When a file is missing or wrong, a recording is fitted and held out at once, an input that was recorded has no place in the model, or the
/// recordings cannot be fitted.
pub fn open(recordings: &Recordings, model: Option<&Path>, grip: Option<&Path>, ignored: &[String]) -> Result<Opened, SetError> {
    let grip = grip.filter(|g| *g != Path::new("none"));
    let mut notes = Vec::new();
    let (mut set, states_fit) = set_of(recordings)?;
    if model.is_none() && set.model.is_none() {
        let first = recordings.first();
        return Err(SetError::new(format!(
            "{first}: no model is named; give one with --model MODEL.toml, or a set.toml with model = \"...\""
        )));
    }
    hold_out(&mut set, states_fit, &mut notes);
    notes.extend(checks::repeated(&set)?);
    notes.extend(set.fit.iter().chain(&set.held_out).filter_map(|file| begun(&set, file)));
    let problem = match grip {
        None => Problem::of_set(&set, model),
        Some(grip) => {
            let path = model.map(Path::to_path_buf).or_else(|| set.model.clone()).unwrap_or_default();
            let held = held(&path, grip)?;
            Problem::of_text(&set, held, path)
        }
    };
    let problem = problem.map_err(|e| told_failure(&e, model, &set))?;
    let problem =
        problem.without_named_outputs(|name| ignored.iter().chain(&set.ignore).any(|other| other == name)).map_err(SetError::new)?;
    checks::repeated_samples(&problem)?;
    notes.extend(checks::left_out(&set, &problem.model, ignored, grip.is_some())?);
    if !set.mixed_rates {
        audit::rates(&problem).map_err(SetError::new)?;
    }
    audit::usable(&problem).map_err(SetError::new)?;
    let inputs = [model.map(Path::to_path_buf).or_else(|| set.model.clone()), grip.map(Path::to_path_buf)];
    let files = inputs.into_iter().flatten().chain(set.paths()).collect();
    Ok(Opened { problem, name: recordings.name(), notes, files })
}

/// The set of these recordings, and whether its file states what is fitted.
///
/// # Errors
/// When a file or folder is not there, or the set cannot be read.
pub fn set_of(recordings: &Recordings) -> Result<(RecordingSet, bool), SetError> {
    let paths = match recordings {
        Recordings::Files(paths) => paths.as_slice(),
        Recordings::Set(set) => return Ok((set.as_ref().clone(), false)),
    };
    match paths {
        [one] if is_recording(one) => Ok((of_files(paths)?, false)),
        [one] => {
            if !one.exists() {
                return Err(SetError::new(format!("{}: there is no such file or folder", one.display())));
            }
            if let Some(command) = import_command(one) {
                return Err(SetError::new(format!("{}: is not a set of recordings yet: `{command}` makes it one", one.display())));
            }
            let states_fit = !one.is_dir() || one.join("set.toml").exists();
            Ok((RecordingSet::open(one)?, states_fit))
        }
        _ => Ok((of_files(paths)?, false)),
    }
}

/// Holds the last of several recordings out where the set does not say what is. Notes say so, and which recordings did not come to their end.
pub fn hold_out(set: &mut RecordingSet, states_fit: bool, notes: &mut Vec<String>) {
    notes.extend(set.paths().iter().filter_map(|path| unfinished(path)));
    if set.held_out.is_empty() {
        match set.fit.len() {
            // Where a set.toml states what is fitted, that is not changed.
            _ if states_fit => notes.push(
                "no recording is held out, so the improvement is shown on the fitted ones; name some under held_out in set.toml"
                    .to_string(),
            ),
            0 | 1 => notes
                .push("only one recording: it is used for the fit and the test; a second one, held out, would test the result".to_string()),
            _ => {
                if let Some(last) = set.fit.pop() {
                    notes.push(format!(
                        "{} is held out: no fit uses it",
                        Path::new(&last).file_name().map_or(last.clone(), |n| n.to_string_lossy().into_owned())
                    ));
                    set.held_out.push(last);
                }
            }
        }
    }
}

/// The text of a model with a grip on its axes.
fn held(model: &Path, grip: &Path) -> Result<String, SetError> {
    let (free, grip_name) = (Model::load(model)?, grip.display());
    let (held, _) = free.held_by(&Fragment::load(grip)?);
    if held == free {
        let why = if free.axes.is_empty() { "has no [[axes]]" } else { "contains the user's hand already" };
        return Err(SetError::new(format!("{}: {why}, so {grip_name} cannot be put on it; omit --grip", model.display())));
    }
    Ok(held.to_toml())
}

/// What is wrong with a bag whose recording did not come to its end; `None` where nothing is, and for what is no bag. What cannot be read at all is
/// reported when it is used.
fn unfinished(path: &Path) -> Option<String> {
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap")) {
        return None;
    }
    let reader = Reader::open(path).ok()?;
    let name = path.display();
    let recover = format!("its remaining content is used; make a clean copy: {}", recover_command(path));
    if let Some(damage) = reader.damage().first() {
        return Some(format!("{name} is damaged ({damage}): {recover}"));
    }
    if !reader.ended_cleanly() {
        return Some(format!("{name} was not closed: {recover}"));
    }
    // A bag of its own, whatever its header states: by its messages.
    let faults = Account::of(&reader).ok()?.faults;
    let (first, more) = (faults.first()?, faults.len() - 1);
    let others = if more > 0 { format!(", and {more} more: see `backdrive bag info --check {name}`") } else { String::new() };
    Some(format!("{name} is incomplete: {first}{others}"))
}

/// What to know of a bag that is longer than what is read of it.
fn begun(set: &RecordingSet, file: &str) -> Option<String> {
    if !set.is_bag(file) || set.rules_of(file).piece.rows.is_some() {
        return None;
    }
    let path = set.path_of(file);
    let longest = backdrive_bags::info(&path).ok()?.topics.iter().map(|topic| topic.messages).max().unwrap_or(0);
    (longest > MOST_OF_A_BAG as u64).then(|| {
        let of = format!("{}: of {longest} samples of a signal the first {MOST_OF_A_BAG} are read", path.display());
        format!("{of}; rows = [FROM, TO] in set.toml selects another part of it")
    })
}

/// Refuses to write onto a file that was read.
///
/// # Errors
/// When `out` is one of `files`: a recording in any case, the model or the grip where `overwrite` does not allow it.
pub fn not_onto(out: &Path, files: &[PathBuf], overwrite: bool) -> Result<(), SetError> {
    let Some(file) = files.iter().find(|f| checks::is_same_file(f, out)) else { return Ok(()) };
    let name = out.display();
    match (is_recording(file), overwrite) {
        (true, _) => Err(SetError::new(format!("{name}: is a recording that is read; write to another file"))),
        (false, false) => Err(SetError::new(format!("{name}: is an input and would be lost; write to another file, or use --overwrite"))),
        (false, true) => Ok(()),
    }
}

fn is_recording(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv") || e.eq_ignore_ascii_case("mcap"))
}

/// Single files as a set.
fn of_files(paths: &[PathBuf]) -> Result<RecordingSet, SetError> {
    for path in paths {
        if !is_recording(path) {
            let what = match import_command(path) {
                Some(command) => format!("is read as a bag: `{command}` makes it one"),
                None => "is not a recording (.csv or .mcap); name one set, or recordings only".to_owned(),
            };
            return Err(SetError::new(format!("{}: {what}", path.display())));
        }
        if !path.is_file() {
            return Err(SetError::new(format!("{}: there is no such file", path.display())));
        }
    }
    let fit = paths.iter().map(|p| p.to_string_lossy().into_owned()).collect();
    Ok(RecordingSet::of_recordings(PathBuf::new(), fit))
}

/// The error, with what to do about it where that is not plain.
fn told_failure(error: &ProblemError, model: Option<&Path>, set: &RecordingSet) -> SetError {
    let hint = match error {
        ProblemError::Recording(RecordingError::NoSignal { .. }) => {
            let model = model.or(set.model.as_deref()).map_or(String::new(), |m| format!(" of {}", m.display()));
            format!("; every input{model} needs a column of its name, or name the column under [columns] of set.toml")
        }
        ProblemError::Recording(RecordingError::NotRising { .. }) => {
            "; sort the rows, or split the file where its clock restarts".to_string()
        }
        ProblemError::Recording(RecordingError::NotFinite { .. }) => {
            "; leave the row out, or name the rows that count in set.toml".to_string()
        }
        ProblemError::Set(_) if set.fit.is_empty() => "; name some in set.toml under fit".to_string(),
        _ => String::new(),
    };
    SetError::new(format!("{error}{hint}"))
}
