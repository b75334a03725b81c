//! `backdrive diagnose`: which physics a model leaves out, by recordings of its device.

use crate::cli;
use crate::diagnose_page::{Shown, page};
use crate::diagnose_text::text;
use crate::failure::{Failure, code};
use crate::interrupt;
use crate::output;
use crate::progress;
use crate::recordings::{self, Opened};
use backdrive_diagnosis::audit::{self, Remark};
use backdrive_diagnosis::locate::{self, Location, locate};
use backdrive_diagnosis::per_record::{PerRecord, fit_each};
use backdrive_diagnosis::physics::physics_named;
use backdrive_diagnosis::problem::Problem;
use backdrive_diagnosis::search::{Search, Settings, search};
use backdrive_diagnosis::verdict::{EXPERIMENT_FILE, Verdict, rival_file, verdict};
use backdrive_diagnosis::work::{Budget, Steps};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Name of the model file that is written.
pub const MODEL: &str = "model.diagnosed.toml";
/// Name of the report, where no other is asked for.
pub const REPORT: &str = "report.html";
/// Work in which each record is fitted by itself, at most.
const PER_RECORD: Steps = 200_000_000;

/// Everything that was found.
pub struct Found {
    /// The model and its recordings.
    pub problem: Problem,
    /// What the recordings say of themselves.
    pub remarks: Vec<Remark>,
    /// Structures and their fits.
    pub search: Search,
    /// What follows.
    pub said: Verdict,
    /// The refitted nominal model fitted to each record by itself.
    pub per_record: PerRecord,
    /// The latent force that the refitted nominal model needs, at every place; `None` where it cannot be had.
    pub location: Option<Location>,
}

/// Diagnoses, writes, and says what was found.
pub fn diagnose(options: &cli::Diagnose) -> Result<u8, Failure> {
    let began = Instant::now();
    let stop = interrupt::heard()?;

    let open = || recordings::open(&options.set, options.model.as_deref(), options.grip.as_deref(), &options.ignore_signal);
    let opened = progress::busy("reading the recordings", open)?;
    for name in [MODEL, EXPERIMENT_FILE] {
        recordings::not_onto(&options.out.join(name), &opened.files, false)?;
    }
    for note in &opened.notes {
        output::note(format_args!("note: {note}"));
    }
    let settings = Settings {
        without: options.without.clone(),
        effects: usize::from(options.effects),
        effort: options.effort,
        patience: Duration::from_secs_f64(options.patience),
    };
    let beside = options.out.join(REPORT);
    let report = (!options.no_report).then_some(options.html.as_deref().unwrap_or(&beside));
    let Diagnosed { found, written } = diagnose_into(opened, &settings, &options.out, report, &stop)?;
    let seconds = began.elapsed().as_secs_f64();
    let path = options.out.join("time.txt");
    output::file(&path, format!("{seconds:.2}\n"))?;
    if options.json {
        output::json(&found.said.json)?;
    } else {
        output::line(text(&found))?;
        output::line(format_args!("wrote     {}: {} ({seconds:.1} s)", shown(&options.out), written.join(", ")))?;
    }
    if stop.load(Ordering::SeqCst) {
        return Err(Failure { code: code::INTERRUPTED, message: "stopped; what was found until then is written".to_string() });
    }
    Ok(exit_code(&found.said.json))
}

/// A diagnosis, and the files that were written of it.
pub struct Diagnosed {
    /// Everything that was found.
    pub found: Found,
    /// Names of the files in the folder that was given, and the path of a report that went elsewhere.
    pub written: Vec<String>,
}

/// Diagnoses what was opened and writes verdict, model and next experiment into a folder, which is made if it is not there, and where wanted the
/// report.
///
/// # Errors
/// When the folder cannot be written, or the nominal model cannot be simulated on the recordings.
pub fn diagnose_into(
    opened: Opened,
    settings: &Settings,
    out: &Path,
    report: Option<&Path>,
    stop: &AtomicBool,
) -> Result<Diagnosed, Failure> {
    // What cannot be written is told before the work, not after it.
    output::folder(out)?;
    report.map_or(Ok(()), output::writable)?;
    let found = progress::about(settings.expected(), |report| find(opened.problem, settings, stop, report))?;

    let write = |name: &str, text: &str| output::file(&out.join(name), text);
    let json = serde_json::to_string_pretty(&found.said.json).map_err(Failure::input)?;
    write("verdict.json", &format!("{json}\n"))?;
    write(MODEL, &found.said.model)?;
    let mut written = vec!["verdict.json".to_string(), MODEL.to_string()];
    // Rivals of an earlier diagnosis are none of this one.
    for number in 1..=9 {
        let _ = std::fs::remove_file(out.join(rival_file(number)));
    }
    for (index, rival) in found.said.rivals.iter().enumerate() {
        write(&rival_file(index + 1), rival)?;
    }
    if let Some(experiment) = &found.said.experiment {
        write(EXPERIMENT_FILE, experiment)?;
        written.push(EXPERIMENT_FILE.to_string());
    }
    if let Some(report) = report {
        let shown = Shown { found: &found, name: &opened.name, notes: &opened.notes };
        output::file(report, page(&shown).html())?;
        written.push(if report == out.join(REPORT) { REPORT.to_string() } else { report.display().to_string() });
    }
    Ok(Diagnosed { found, written })
}

fn shown(folder: &Path) -> String {
    let text = folder.display().to_string();
    if text.is_empty() { ".".to_string() } else { text }
}

/// By what the verdict says.
pub fn exit_code(verdict: &Value) -> u8 {
    match verdict["verdict"].as_str() {
        Some("nothing_missing" | "parameters") => 0,
        Some("cannot_tell") => code::CANNOT_TELL,
        _ => code::NEGATIVE,
    }
}

/// Audit, search, verdict, and what shows it.
fn find(problem: Problem, settings: &Settings, stop: &AtomicBool, report: &(dyn Fn(&str) + Sync)) -> Result<Found, Failure> {
    let limit = settings.limit(Some(stop));
    report("looking at the recordings");
    let remarks = audit::audit(&problem);
    let search = search(&problem, settings, limit, report).map_err(Failure::input)?;
    report("deciding");
    let mut said = verdict(&problem, &search, MODEL).map_err(Failure::input)?;
    if said.json.get("audit").is_none_or(Value::is_null) {
        said.json["audit"] = audit::json(&remarks);
    }
    report("fitting each record by itself");
    let per_record = fit_each(&problem, &search.nominal, &search.floor, &Budget::new(PER_RECORD, limit));
    report("locating the missing force");
    let location = located(&problem, &search);
    if said.json["where"].is_object() && said.json["where"]["state"].is_null() {
        said.json["where"]["state"] = json!(state(&said.json, location.as_ref()));
    }
    if said.json["verdict"] == "unexplained"
        && let Some(best) = location.as_ref().and_then(|l| l.ranking.first())
    {
        // What kind of force it is, where no law is its name.
        said.json["where"]["class"] = serde_json::to_value(best.character).unwrap_or(Value::Null);
    }
    Ok(Found { problem, remarks, search, said, per_record, location })
}

/// In which state the mismatch shows: as the law that is claimed has it, else as the latent force does.
fn state(verdict: &Value, location: Option<&Location>) -> Option<String> {
    match verdict["verdict"].as_str() {
        Some("missing" | "ambiguous") => {
            let finding = &verdict["findings"][0];
            let place = match (finding["between"].as_array(), finding["signal"].as_str()) {
                (Some(ends), _) => ends.iter().filter_map(Value::as_str).collect::<Vec<_>>().join("-"),
                (_, Some(signal)) => signal.to_string(),
                _ => return None,
            };
            Some(physics_named(finding["physics"].as_str()?)?.state_at(&place))
        }
        Some("unexplained") => location.and_then(locate::state),
        _ => None,
    }
}

/// The latent force that the refitted nominal model needs.
fn located(problem: &Problem, search: &Search) -> Option<Location> {
    let nominal = &search.nominal;
    let model = nominal.structure.model(problem, &nominal.fit.values)?;
    let records = nominal.structure.with_unknown(problem, &problem.fit, &nominal.fit.values);
    let runs: Vec<locate::Run> = records.iter().map(locate::Run::from).collect();
    locate(&model, &runs, &search.floor, &locate::Options::quick()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_is_that_of_the_claimed_law() {
        let verdict = json!({ "verdict": "missing", "findings": [{ "physics": "coulomb", "between": ["drum", "ground"] }] });
        assert_eq!(state(&verdict, None).as_deref(), Some("reversals of the velocity across drum-ground"));
        let verdict = json!({ "verdict": "missing", "findings": [{ "physics": "delay", "signal": "force" }] });
        assert_eq!(state(&verdict, None).as_deref(), Some("with the rate of change of force"));
        assert_eq!(state(&json!({ "verdict": "nothing_missing" }), None), None);
    }

    #[test]
    fn exit_codes_follow_the_verdict() {
        let code_of = |word: &str| exit_code(&json!({ "verdict": word }));
        assert_eq!(["nothing_missing", "parameters"].map(code_of), [0, 0]);
        assert_eq!(["missing", "unexplained", "ambiguous"].map(code_of), [1, 1, 1]);
        assert_eq!(code_of("cannot_tell"), 7);
    }
}
