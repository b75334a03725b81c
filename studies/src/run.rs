//! A diagnosis like that of `backdrive diagnose`, from a set whose recordings lie in another folder.

use crate::{Context, StudyError};
use backdrive::diagnose::{REPORT, diagnose_into};
use backdrive::failure::Failure;
use backdrive_answers::asked::Asked;
use backdrive_answers::found::Diagnosed;
use backdrive_answers::opened::open;
use backdrive_diagnosis::audit::{Remark, audit};
use backdrive_diagnosis::belief::compare::{predictions, qualities};
use backdrive_diagnosis::diagnose::Diagnosis;
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::output_error::structure::Structure;
use backdrive_diagnosis::physics::PHYSICS;
use backdrive_diagnosis::recordings::problem::{Problem, Record};
use backdrive_diagnosis::verdict::{Estimate, Finding, MODEL_FILE, Parameter, Verdict};
use backdrive_plant::model::Model;
use nalgebra::{DMatrix, DVector};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use toml_edit::{Array, DocumentMut, Item};

/// How a diagnosis is made.
#[derive(Debug, Clone)]
pub struct Ask<'a> {
    /// Name of the folder of results; empty for the study's own.
    pub name: &'a str,
    /// The set, a file in the study's folder.
    pub set: &'a str,
    /// The nominal model, a file in the study's folder.
    pub model: &'a str,
    /// Effects that are withheld.
    pub without: &'a [&'a str],
    /// How many effects may be missing at once, at most.
    pub effects: usize,
    /// How much the search may compute, as a multiple of what it does by default.
    pub effort: f64,
}

/// Diagnoses a set of the study. The folder of results gets verdict.json, report.html, model.diagnosed.toml, the nominal model and a set.toml that
/// `backdrive diagnose` takes without change.
///
/// # Errors
/// When a file cannot be read or written, or the diagnosis fails.
pub fn diagnose(context: &Context, ask: &Ask) -> Result<Diagnosis, StudyError> {
    let (out, set) = placed(context, ask)?;
    let options = Options {
        without: ask.without.iter().map(|s| s.to_string()).collect(),
        effects: Some(ask.effects),
        effort: Some(ask.effort * context.longer),
        ..Options::default()
    };
    let opened = open(&Asked { set: set.as_path().into(), options, ..Asked::default() }).map_err(Failure::from)?;
    let answer = diagnose_into(opened, &out, Some(&out.join(REPORT)), &AtomicBool::new(false))?;
    match answer.found.device {
        Diagnosed::OneAxis(found) => Ok(*found),
        Diagnosed::Arm(_) | Diagnosed::Servo(_) => Err(StudyError::Diagnosis(format!("{}: is no device of one axis", ask.set))),
    }
}

/// Puts the model and the set of a diagnosis into its folder of results: the folder, and the set there.
fn placed(context: &Context, ask: &Ask) -> Result<(PathBuf, PathBuf), StudyError> {
    let out = if ask.name.is_empty() { context.out.to_path_buf() } else { context.out.join(ask.name) };
    std::fs::create_dir_all(&out).map_err(|e| StudyError::Write(format!("{}: cannot be made: {e}", out.display())))?;
    // What the study made itself, a set of what it simulated or a model that it found, lies with its results.
    let given = |name: &str| {
        let own = context.folder.join(name);
        read(&if own.is_file() { own } else { context.out.join(name) })
    };
    write(&out.join("model.toml"), &given(ask.model)?)?;
    let resolved = resolve(&given(ask.set)?, &[context.out, context.data]).map_err(|e| StudyError::File(format!("{}: {e}", ask.set)))?;
    let set = out.join("set.toml");
    write(&set, &resolved)?;
    Ok((out, set))
}

/// The audit's remarks on the recordings of a set; nothing is fitted.
///
/// # Errors
/// When a file cannot be read or written, or the set and the model do not match.
pub fn remarks(context: &Context, ask: &Ask) -> Result<Vec<Remark>, StudyError> {
    let (_, set) = placed(context, ask)?;
    let problem = Problem::open(&set, None).map_err(|e| StudyError::Diagnosis(e.to_string()))?;
    Ok(audit(&problem))
}

/// The nominal model refitted, its structure unchanged, as `backdrive fit` does: no effect is considered.
///
/// # Errors
/// As [`diagnose`].
pub fn refit(context: &Context, ask: &Ask) -> Result<Diagnosis, StudyError> {
    let all: Vec<&str> = PHYSICS.iter().map(|p| p.name).collect();
    diagnose(context, &Ask { without: &all, ..ask.clone() })
}

/// A number of the nominal structure as the refit has it, by its path; NaN where the model states none.
pub fn refitted(found: &Diagnosis, path: &str) -> f64 {
    let (problem, nominal) = (&found.problem, &found.search.nominal);
    let values = nominal.structure.stated_of(problem, &nominal.fit.values);
    problem.stated.iter().zip(values).find(|(s, _)| s.path == path).map_or(f64::NAN, |(_, v)| v)
}

/// The model that a diagnosis wrote.
///
/// # Errors
/// When it cannot be read.
pub fn diagnosed_model(context: &Context, ask: &Ask) -> Result<Model, StudyError> {
    Ok(Model::load(&context.out.join(ask.name).join(MODEL_FILE))?)
}

/// The text of a set with its model beside it and its recordings where they are: the first folder that holds each. Files under `[files]`
/// follow.
fn resolve(text: &str, folders: &[&Path]) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|e| format!("{e}"))?;
    let place = |name: &str| -> String {
        let found: Option<PathBuf> = folders.iter().map(|f| f.join(name)).find(|p| p.is_file());
        found.map_or(name.to_string(), |p| p.canonicalize().unwrap_or(p).display().to_string())
    };
    document["model"] = toml_edit::value("model.toml");
    let resolved = |list: Option<&mut Array>| {
        for value in list.into_iter().flat_map(Array::iter_mut) {
            if let Some(name) = value.as_str().map(place) {
                *value = name.into();
            }
        }
    };
    for key in ["fit", "held_out"] {
        resolved(document.get_mut(key).and_then(Item::as_array_mut));
    }
    for (_, session) in document.get_mut("sessions").and_then(Item::as_table_like_mut).into_iter().flat_map(|t| t.iter_mut()) {
        resolved(session.as_table_like_mut().and_then(|t| t.get_mut("files")).and_then(Item::as_array_mut));
    }
    if let Some(files) = document.get_mut("files").and_then(Item::as_table_like_mut) {
        let names: Vec<String> = files.iter().map(|(name, _)| name.to_string()).collect();
        for name in names {
            if let Some(rules) = files.remove(&name) {
                files.insert(&place(&name), rules);
            }
        }
    }
    Ok(document.to_string())
}

/// Names of the effects of a verdict's findings, most important first, each with its place.
pub fn findings(verdict: &Verdict) -> Vec<(String, String)> {
    verdict.findings.iter().map(|finding| (finding.physics.clone(), finding.place.to_string())).collect()
}

/// A verdict in one line: its word and the effects it names.
pub fn said(verdict: &Verdict) -> String {
    let named: Vec<String> = findings(verdict).into_iter().map(|(physics, place)| format!("{physics} at {place}")).collect();
    let word = verdict.word.spoken();
    if named.is_empty() { word } else { format!("{word}: {}", named.join(", ")) }
}

/// Confidence above which an alternative is worth a line.
pub const LIKELY: f64 = 0.05;

/// Alternatives to each finding of the verdict, with a confidence above this.
pub fn instead(verdict: &Verdict, least: f64) -> Vec<String> {
    let mut all = Vec::new();
    for finding in &verdict.findings {
        for other in finding.alternatives.iter().filter(|other| other.confidence > least) {
            let text = format!("{} for {} ({:.2})", other.physics, finding.physics, other.confidence);
            if !all.contains(&text) {
                all.push(text);
            }
        }
    }
    all
}

/// Value and 95 % interval of a finding's parameter; `None` where it is a list or not there.
pub fn parameter(verdict: &Verdict, physics: &str, key: &str) -> Option<(f64, [f64; 2])> {
    let named = |finding: &&Finding| finding.physics == physics;
    match verdict.findings.iter().find(named)?.parameters.get(key)? {
        Parameter::One(Estimate { value, ci95: [Some(low), Some(high)], .. }) => Some((*value, [*low, *high])),
        Parameter::One(_) | Parameter::List(_) => None,
    }
}

/// Value of a finding's parameter, of a list the sum; `None` where there is none.
pub fn total(verdict: &Verdict, physics: &str, key: &str) -> Option<f64> {
    match verdict.findings.iter().find(|finding| finding.physics == physics)?.parameters.get(key)? {
        Parameter::One(one) => Some(one.value),
        Parameter::List(list) => Some(list.value.iter().sum()),
    }
}

/// Normalised error of a problem's own model for each of its records.
///
/// # Errors
/// When the model cannot be simulated.
pub fn errors_of(problem: &Problem, records: &[Record]) -> Result<Vec<(String, f64)>, StudyError> {
    let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let structure = Structure::new(problem, &problem.fit, Vec::new());
    let predicted = predictions(problem, records, &structure, &structure.values(problem, &given, &[], &[]))
        .ok_or_else(|| StudyError::Diagnosis("the diagnosed model cannot be simulated".to_string()))?;
    let all = qualities(problem, records, &predicted, &problem.noise_sd, false);
    Ok(all.into_iter().map(|q| (backdrive_pages::parts::file_name(&q.record).to_string(), q.nrmse)).collect())
}

/// Least squares: what the columns have to be multiplied with to give the right side.
///
/// # Errors
/// When the decomposition does not converge.
pub fn solved(columns: &[&[f64]], right: &[f64]) -> Result<Vec<f64>, StudyError> {
    let matrix = DMatrix::from_fn(right.len(), columns.len(), |i, j| columns[j][i]);
    let numbers =
        matrix.svd(true, true).solve(&DVector::from_column_slice(right), 1e-12).map_err(|e| StudyError::Diagnosis(e.to_string()))?;
    Ok(numbers.iter().copied().collect())
}

/// An error of a verdict in percent; NaN where there is none.
pub fn percent(error: Option<f64>) -> f64 {
    error.map_or(f64::NAN, |x| 100.0 * x)
}

/// Reads a text file.
///
/// # Errors
/// When it cannot be read.
pub fn read(path: &Path) -> Result<String, StudyError> {
    std::fs::read_to_string(path).map_err(|e| StudyError::File(format!("{}: cannot be read: {e}", path.display())))
}

/// Writes a text file.
///
/// # Errors
/// When it cannot be written.
pub fn write(path: &Path, text: &str) -> Result<(), StudyError> {
    std::fs::write(path, text).map_err(|e| StudyError::Write(format!("{}: cannot be written: {e}", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_plant::set::RecordingSet;

    #[test]
    fn a_set_finds_recordings_that_lie_elsewhere() {
        let (data, out) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        std::fs::write(data.path().join("a.csv"), "t,x\n0,1\n1,2\n").unwrap();
        std::fs::write(out.path().join("prepared.csv"), "t,x\n0,1\n1,2\n").unwrap();
        std::fs::write(out.path().join("model.toml"), "").unwrap();
        let text = "model = 'other.toml'\nfit = ['prepared.csv']\nheld_out = ['a.csv']\n[files.'a.csv']\nrows = [0, 2]\n\
                    [sessions.b]\nfiles = ['a.csv']\ncondition = { bodies.carriage = 'free' }\n";
        let resolved = resolve(text, &[out.path(), data.path()]).unwrap();
        let set = out.path().join("set.toml");
        std::fs::write(&set, resolved).unwrap();
        let set = RecordingSet::open(&set).unwrap();
        assert!(set.path_of(&set.held_out[0]).starts_with(data.path().canonicalize().unwrap()));
        assert_eq!(set.rules_of(&set.held_out[0]).piece.rows, Some([0, 2]));
        assert_eq!(set.rules_of(&set.held_out[0]).condition.len(), 1);
        assert!(set.path_of(&set.fit[0]).ends_with("prepared.csv"));
    }
}
