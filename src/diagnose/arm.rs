//! `backdrive diagnose` of a model with a robot: logs of position and torque of every joint.

use crate::cli;
use crate::failure::Failure;
use crate::output;
use crate::recordings;
use backdrive_arms::diagnose::{EXPERIMENT_FILE, Found, Settings, diagnose as diagnosed};
use backdrive_arms::problem::Problem;
use backdrive_arms::verdict::words;
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::verdict::{Estimate, Finding, MODEL_FILE, Parameter, VERDICT_FILE, Word};
use backdrive_diagnosis::words as said;
use backdrive_plant::model::Model;
use backdrive_plant::set::RecordingSet;
use backdrive_report::{number, si};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The set and the model, where the model has a robot; `None` for a device of one axis, and where something is wrong that is told there.
pub fn asked(options: &cli::Diagnose) -> Result<Option<(RecordingSet, PathBuf)>, Failure> {
    let Ok((mut set, told)) = recordings::set_of(&options.set) else { return Ok(None) };
    let Some(model) = options.model.clone().or_else(|| set.model.clone()) else { return Ok(None) };
    match Model::load(&model) {
        Ok(read) if read.arm.is_some() => {}
        _ => return Ok(None),
    }
    let mut notes = Vec::new();
    recordings::hold_out(&mut set, told, &mut notes);
    notes.iter().for_each(|note| output::note(format_args!("note: {note}")));
    Ok(Some((set, model)))
}

/// Diagnoses an arm, writes, and says what was found.
pub fn diagnose(options: &cli::Diagnose, set: &RecordingSet, model: &Path, began: Instant) -> Result<Word, Failure> {
    let files: Vec<PathBuf> =
        std::iter::once(model.to_path_buf()).chain(set.fit.iter().chain(&set.held_out).map(|f| set.path_of(f))).collect();
    for name in [MODEL_FILE, EXPERIMENT_FILE] {
        recordings::not_onto(&options.out.join(name), &files, false)?;
    }
    output::folder(&options.out)?;
    let problem = Problem::open(set, Some(model)).map_err(Failure::input)?;
    let settings = Settings { without: options.without.clone(), ..Settings::default() };
    let found = diagnosed(&problem, &settings).map_err(Failure::input)?;
    let write = |name: &str, text: &str| output::file(&options.out.join(name), text);
    let json = serde_json::to_string_pretty(&found.verdict).map_err(Failure::input)?;
    write(VERDICT_FILE, &format!("{json}\n"))?;
    write(MODEL_FILE, &found.model)?;
    write(EXPERIMENT_FILE, &found.experiment)?;
    let seconds = began.elapsed().as_secs_f64();
    write("time.txt", &format!("{seconds:.2}\n"))?;
    if options.json {
        output::json(&found.verdict)?;
    } else {
        output::line(text(&problem, &found))?;
        let names = [VERDICT_FILE, MODEL_FILE, EXPERIMENT_FILE].join(", ");
        output::line(format_args!("wrote     {}: {names} ({seconds:.1} s)", options.out.display()))?;
    }
    Ok(found.verdict.word)
}

/// What was found, for a terminal.
fn text(problem: &Problem, found: &Found) -> String {
    let mut out = String::new();
    let mut line = |name: &str, text: String| {
        let _ = writeln!(out, "{name:<9} {text}");
    };
    let verdict = &found.verdict;
    let all = problem.fit.len() + problem.held_out.len();
    line("logs", format!("{all} of {} joints ({} held out)", problem.joints.len(), problem.held_out.len()));
    for remark in verdict.audit.iter().filter(|r| r.weight > Weight::Note) {
        line("", format!("{}: {}", remark.place, remark.message));
    }
    line("verdict", format!("{}: {}", verdict.word.spoken().to_uppercase(), verdict.sentence));
    for finding in &verdict.findings {
        line("found", finding_text(finding));
        let others: Vec<String> = finding
            .alternatives
            .iter()
            .take(3)
            .map(|a| format!("{} {} ({})", words(&a.physics), said::place(&a.place), said::share(a.confidence)))
            .collect();
        if !others.is_empty() {
            line("", format!("or instead {}", others.join(", ")));
        }
    }
    if let Some(arm) = &verdict.arm {
        for joint in &arm.joints {
            let in_loop = match (joint.loop_refit, joint.loop_diagnosed) {
                (Some(before), Some(after)) => format!("; in closed loop {} and {}", said::share(before), said::share(after)),
                _ => String::new(),
            };
            line(
                &joint.joint,
                format!(
                    "of its torque (rms {}) remain {:.1} % as given, {:.1} % refitted, {:.1} % diagnosed{in_loop}",
                    number(joint.torque_rms),
                    100.0 * joint.as_given,
                    100.0 * joint.refit,
                    100.0 * joint.diagnosed
                ),
            );
        }
    }
    if let Some(next) = &verdict.next_experiment {
        line("next", next.sentence().to_string());
    }
    for note in &found.notes {
        line("note", note.clone());
    }
    out.trim_end().to_string()
}

fn finding_text(finding: &Finding) -> String {
    let numbers: Vec<String> = finding
        .parameters
        .iter()
        .map(|(name, value)| match value {
            Parameter::One(Estimate { value, ci95: [Some(low), Some(high)], unit, .. }) => {
                format!("{} {} (95 %: {} to {})", name.replace('_', " "), si(*value, unit), si(*low, unit), si(*high, unit))
            }
            Parameter::One(Estimate { value, unit, .. }) => format!("{} {}", name.replace('_', " "), si(*value, unit)),
            Parameter::List(list) => {
                let all: Vec<String> = list.value.iter().map(|x| number(*x)).collect();
                format!("{} ({}) {}", name.replace('_', " "), all.join(", "), list.unit)
            }
        })
        .collect();
    format!(
        "{} {}: {}; confidence {}",
        words(&finding.physics),
        said::place(&finding.place),
        numbers.join(", "),
        said::share(finding.confidence)
    )
}
