//! Triage of one recording: checks without a model, the common parameters of each joint by regression, and the residual.
//!
//! The torque of a joint less that of the model's links is `dry·s + viscous·v + constant + gain·τ_links + inertia·a - lag·dτ_links/dt`, where s is the
//! direction of dry friction. Of a joint by commands and positions the command less the position takes the place of the torque. Both sides go through the
//! filters of the regression of arms ([`backdrive_diagnosis::arms::motion`]). Delay and lost motion of a servo are fitted in time (`triage/response.rs`).

mod joints;
mod regress;
mod response;

use crate::answered::{Answered, Row};
use crate::error::FleetError;
use crate::manifest::{Entry, Loaded, Manifest, Source};
use crate::parameter;
use backdrive_inspect::{Options, Report, Source as Inspected, Weight, inspect};
use joints::{JointData, joints_of};
use regress::{Regressed, regress};
use response::{Start, response};
use serde_json::json;

/// Triage of one recording.
///
/// # Errors
/// The recording cannot be read, or has neither torques nor commands of joints.
pub fn triage(manifest: &Manifest, entry: &Entry, loaded: &Loaded) -> Result<Answered, FleetError> {
    let set = manifest.set_of(entry, loaded)?;
    let joints = joints_of(&set, entry.model.as_deref())?;
    let report = checked(entry, loaded);
    let mut rows = Vec::new();
    for joint in &joints {
        rows.push(row(joint, &regress(joint), report.as_ref().ok()));
    }
    let wrong: Vec<String> = report.iter().flat_map(|report| report.wrong()).map(|finding| finding.message.clone()).collect();
    let sentence = match wrong.first() {
        None => format!("{} joints, no problem found in the recording", rows.len()),
        Some(first) if wrong.len() == 1 => format!("the recording has a problem: {first}"),
        Some(first) => format!("the recording has {} problems; the first: {first}", wrong.len()),
    };
    let findings = report.as_ref().map_or_else(|e| json!({ "not_checked": e }), |report| json!(report.findings));
    let verdict = json!({ "what": "triage", "sentence": sentence, "findings": findings, "joints": rows });
    Ok(Answered { sentence, error: None, rows, verdict })
}

/// The checks without a model.
fn checked(entry: &Entry, loaded: &Loaded) -> Result<Report, String> {
    let source = match (loaded.columns(), &entry.source) {
        (Some(columns), _) => Inspected::Columns { name: entry.name.clone(), columns },
        (None, Source::File(path) | Source::Episode(path, _)) => Inspected::Path(path.clone()),
    };
    inspect(&[source], &Options::default()).map_err(|e| e.to_string())
}

fn row(joint: &JointData, found: &Regressed, report: Option<&Report>) -> Row {
    let mut row = Row::of(&joint.name);
    row.word("kind", if joint.is_servo { "servo" } else { "torque" });
    let mut estimated = |name: &str, estimate: Option<(f64, f64)>| {
        if let Some((value, sd)) = estimate {
            row.number(name, value);
            row.number(&format!("{name}_sd"), sd);
        }
    };
    for (parameter, estimate) in parameter::REGRESSED.iter().zip(&found.parameters) {
        estimated(parameter.name, *estimate);
    }
    if let (Some(record), [dry, lag, ..]) = (&joint.record, &found.parameters) {
        let size = |of: &Option<(f64, f64)>| of.map_or(0.0, |(value, _)| value.max(0.0));
        let found = response(record, &Start { lag: size(lag), dead_zone: size(dry) });
        estimated(parameter::DELAY.name, found.delay);
        estimated(parameter::LOST_MOTION.name, found.lost_motion);
    }
    for (effect, estimate) in parameter::EFFECTS.iter().zip(&found.effects) {
        if let Some((value, sd)) = estimate {
            row.number(effect.name, *value);
            row.number(&format!("{}_sd", effect.name), *sd);
        }
    }
    row.number("residual", found.residual);
    row.number("effort", found.effort);
    row.number("speed", found.speed);
    row.number("samples", found.rows as f64);
    row.number("rate_hz", joint.rate_hz);
    if let Some(noise) = joint.position_noise {
        row.number("position_noise", noise);
    }
    if let Some(noise) = joint.effort_noise {
        row.number("effort_noise", noise);
    }
    if let Some(step) = joint.position_step {
        row.number("position_step", step);
    }
    let Some(report) = report else {
        row.word("audit", "not checked");
        return row;
    };
    let own = |weight| {
        report.findings.iter().filter(move |finding| finding.weight == weight).filter(|f| f.joint.as_ref().is_none_or(|j| *j == joint.name))
    };
    row.number("problems", own(Weight::Wrong).count() as f64);
    let kinds: Vec<String> = own(Weight::Wrong).filter_map(|f| serde_json::to_value(f.kind).ok()?.as_str().map(str::to_string)).collect();
    row.word("audit", &if kinds.is_empty() { "clean".to_string() } else { kinds.join(", ") });
    if let Some(clock) = report.clocks.first() {
        row.number("jitter_ms", clock.jitter_ms);
        row.number("duration_s", clock.duration_s);
    }
    row
}
