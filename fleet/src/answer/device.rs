//! A diagnosis and a fit of one recording as rows.

use super::fit;
use crate::answered::{Answered, Row};
use crate::error::FleetError;
use crate::manifest::{Entry, Loaded, Manifest};
use backdrive_answers::asked::Asked;
use backdrive_answers::found::{Found, diagnose};
use backdrive_answers::opened::{Opened, open};
use backdrive_diagnosis::arms::problem::Problem as ArmProblem;
use backdrive_diagnosis::hypothesis::Place;
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::verdict::Finding;
use backdrive_plant::model::Model;
use backdrive_predict::fit::{Fit, Options as Fitting};
use backdrive_servo::problem::{Problem as ServoProblem, is_servo};
use backdrive_sets::Recordings;
use serde_json::json;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// A limit on the clock beyond any search: an answer must depend on nothing but its question.
const NO_LIMIT: Duration = Duration::from_secs(7 * 86_400);

/// Diagnoses one recording.
pub(super) fn diagnosed(manifest: &Manifest, entry: &Entry, loaded: &Loaded) -> Result<Answered, FleetError> {
    let options = Options { patience: Some(NO_LIMIT), ..Options::default() };
    let found = diagnose(opened(manifest, entry, loaded, options)?, None, &|_| {}).map_err(FleetError::input)?;
    answered(&found)
}

/// Refits the parameters of the model to one recording: of one axis by simulation, of an arm by regression, of servos by simulation of their answers.
pub(super) fn fitted(manifest: &Manifest, entry: &Entry, loaded: &Loaded) -> Result<Answered, FleetError> {
    let set = manifest.set_of(entry, loaded)?;
    let Some(model) = entry.model.clone() else { return Err(FleetError::input("no model is named; give one with --model MODEL.toml")) };
    if is_servo(&set) {
        return fit::servo(&ServoProblem::open(&set, Some(&model)).map_err(FleetError::input)?);
    }
    if Model::load(&model).map_err(FleetError::input)?.arm.is_some() {
        return fit::arm(&ArmProblem::open(&set, Some(&model)).map_err(FleetError::input)?);
    }
    let options = Fitting { model, set: Recordings::Set(Box::new(set)), grip: None, ignored: Vec::new(), effort: 1.0, patience: NO_LIMIT };
    let fitted = Fit::read(&options).and_then(|fit| fit.run(&AtomicBool::new(false), &|_| {})).map_err(FleetError::input)?;
    let mut row = Row::of("device");
    for parameter in fitted.rows.iter().filter(|parameter| parameter.determined) {
        row.number(&parameter.name, parameter.value);
        row.number(&format!("{}_sd", parameter.name), parameter.standard_error);
    }
    if let Some(worst) = fitted.fitted.iter().map(|quality| quality.nrmse).filter(|n| n.is_finite()).reduce(f64::max) {
        row.number("nrmse", worst);
    }
    row.word("not_determined", &fitted.kept.join(", "));
    let sentence = format!("{} parameters refitted", fitted.rows.len() - fitted.kept.len());
    let verdict = json!({ "what": "fit", "sentence": sentence, "parameters": fitted.rows, "model": fitted.model });
    Ok(Answered { sentence, error: None, rows: vec![row], verdict })
}

fn opened(manifest: &Manifest, entry: &Entry, loaded: &Loaded, options: Options) -> Result<Opened, FleetError> {
    let set = Recordings::Set(Box::new(manifest.set_of(entry, loaded)?));
    let asked = Asked { set, model: entry.model.clone(), options, ..Asked::default() };
    open(&asked).map_err(FleetError::input)
}

fn answered(found: &Found) -> Result<Answered, FleetError> {
    let verdict = found.verdict();
    let value = serde_json::to_value(verdict).map_err(FleetError::input)?;
    let word = value["verdict"].as_str().unwrap_or_default().to_string();
    let mut rows: Vec<Row> = Vec::new();
    let joints: Vec<String> = match &found.device {
        backdrive_answers::found::Diagnosed::Arm(both) => both.0.joints.clone(),
        backdrive_answers::found::Diagnosed::Servo(both) => both.0.joints.iter().map(|joint| joint.name.clone()).collect(),
        backdrive_answers::found::Diagnosed::OneAxis(_) => vec!["device".to_string()],
    };
    for joint in &joints {
        let mut row = Row::of(joint);
        row.word("verdict", &word);
        let here: Vec<&Finding> = verdict.findings.iter().filter(|finding| joints.len() == 1 || acts_at(&finding.place, joint)).collect();
        let names: Vec<&str> = here.iter().map(|finding| finding.physics.as_str()).collect();
        row.word("findings", &names.join(", "));
        for finding in &here {
            row.number(&format!("{}.confidence", finding.physics), finding.confidence);
            for (name, parameter) in &finding.parameters {
                let number = serde_json::to_value(parameter).ok().and_then(|value| value["value"].as_f64());
                row.number(&format!("{}.{name}", finding.physics), number.unwrap_or(f64::NAN));
            }
        }
        for (column, value) in [("nrmse_before", verdict.held_out.nrmse_before), ("nrmse_after", verdict.held_out.nrmse_after)] {
            row.number(column, value.unwrap_or(f64::NAN));
        }
        rows.push(row);
    }
    Ok(Answered { sentence: verdict.sentence.clone(), error: None, rows, verdict: value })
}

/// Whether an effect acts at a joint, or at a part of its network, whose name begins with the joint's.
fn acts_at(place: &Place, joint: &str) -> bool {
    let is_of = |name: &str| name == joint || name.strip_prefix(joint).is_some_and(|rest| rest.starts_with('.'));
    match place {
        Place::Between(a, b) => is_of(a) || is_of(b),
        Place::Signal(name) => is_of(name),
    }
}
