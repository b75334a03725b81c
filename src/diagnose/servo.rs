//! `backdrive diagnose` of joints that position servos drive: logs of commands and positions, without torque.

use crate::cli;
use crate::failure::{Failure, code};
use crate::interrupt;
use crate::offered::{Builder, Step};
use crate::output;
use crate::progress;
use backdrive_diagnosis::verdict::words as said;
use backdrive_diagnosis::verdict::{Finding, MODEL_FILE, Parameter, VERDICT_FILE, Word};
use backdrive_pages::diagnose::servo::page;
use backdrive_pages::estimate::estimate;
use backdrive_plant::set::RecordingSet;
use backdrive_report::number;
use backdrive_servo::diagnose::{Found, diagnose as diagnosed};
use backdrive_servo::problem::{Problem, is_servo};
use backdrive_servo::sentences::words;
use backdrive_sets::{checks, open};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;

/// The set and the model, where the set holds commands and no torque; `None` where it holds something else, or is wrong, which is reported there.
pub fn asked(options: &cli::Diagnose) -> Result<Option<(RecordingSet, Option<PathBuf>)>, Failure> {
    let Ok((mut set, told)) = open::set_of(&options.set) else { return Ok(None) };
    if !is_servo(&set) {
        return Ok(None);
    }
    let model = options.model.clone().or_else(|| set.model.clone());
    let mut notes = checks::repeated(&set)?;
    open::hold_out(&mut set, told, &mut notes);
    notes.iter().for_each(|note| output::note(format_args!("note: {note}")));
    Ok(Some((set, model)))
}

/// Diagnoses servo joints, writes, and prints what was found. `report`: where the page goes, where one is wanted.
pub fn diagnose(
    options: &cli::Diagnose,
    set: &RecordingSet,
    model: Option<&Path>,
    report: Option<&Path>,
    began: Instant,
) -> Result<Word, Failure> {
    if let Some(grip) = options.grip.as_deref().filter(|g| *g != Path::new("none")) {
        return Err(Failure {
            code: code::USAGE,
            message: format!("--grip {}: a hand on a servo joint is not modelled; leave the option out", grip.display()),
        });
    }
    let files: Vec<PathBuf> =
        model.map(Path::to_path_buf).into_iter().chain(set.fit.iter().chain(&set.held_out).map(|f| set.path_of(f))).collect();
    open::not_onto(&options.out.join(MODEL_FILE), &files, false)?;
    // What cannot be written is reported before the work, not after it.
    output::folder(&options.out)?;
    report.map_or(Ok(()), output::writable)?;
    let stop = interrupt::heard()?;
    let problem = Problem::open(set, model).map_err(Failure::input)?;
    let found = progress::stages(|report| diagnosed(&problem, &super::asked(options), Some(&stop), report)).map_err(Failure::input)?;
    let write = |name: &str, text: &str| output::file(&options.out.join(name), text);
    let json = serde_json::to_string_pretty(&found.verdict).map_err(Failure::input)?;
    write(VERDICT_FILE, &format!("{json}\n"))?;
    write(MODEL_FILE, &found.model.to_toml())?;
    let mut written = [VERDICT_FILE, MODEL_FILE].map(str::to_string).to_vec();
    if let Some(report) = report {
        let name = options.set.first().and_then(|p| p.file_name()).map_or(String::new(), |n| n.to_string_lossy().into_owned());
        output::page(report, page(&problem, &found, &name, &to_do(found.verdict.word, &options.out)))?;
        written.push(report.strip_prefix(&options.out).unwrap_or(report).display().to_string());
    }
    let seconds = began.elapsed().as_secs_f64();
    write("time.txt", &format!("{seconds:.2}\n"))?;
    if options.json {
        output::json(&found.verdict)?;
    } else {
        output::line(text(&problem, &found))?;
        if options.explain {
            output::line(format_args!("\n{}\n", explained(&problem, &found)))?;
        }
        output::line(format_args!("wrote     {}: {} ({seconds:.1} s)", options.out.display(), written.join(", ")))?;
    }
    if stop.load(Ordering::SeqCst) {
        return Err(Failure { code: code::INTERRUPTED, message: "stopped; what was found until then is written".to_string() });
    }
    Ok(found.verdict.word)
}

/// What to do next, where the model may be used.
fn to_do(word: Word, out: &Path) -> Vec<Step> {
    let model = out.join(MODEL_FILE);
    let usable = matches!(word, Word::Missing | Word::Parameters | Word::NothingMissing);
    let show = || Builder::verb("model show").reads(&model).build();
    usable.then(|| Step::new(format!("Use {}; this shows its numbers:", model.display()), [show()])).into_iter().collect()
}

/// What was found, for a terminal.
fn text(problem: &Problem, found: &Found) -> String {
    let mut out = String::new();
    let mut line = |name: &str, text: String| {
        let _ = writeln!(out, "{name:<9} {text}");
    };
    let verdict = &found.verdict;
    let held = problem.joints.first().map_or(0, |j| j.held_out.len());
    let all = problem.joints.first().map_or(0, |j| j.fit.len()) + held;
    line("logs", format!("{all}, {held} of them held out; commands and positions of {} joints, no torque", problem.joints.len()));
    for remark in &verdict.audit {
        line("", format!("{}: {}", remark.place, remark.message));
    }
    line("verdict", format!("{}: {}", verdict.word.spoken().to_uppercase(), verdict.sentence));
    for finding in &verdict.findings {
        line("found", finding_text(finding));
        let others: Vec<String> =
            finding.alternatives.iter().take(3).map(|a| format!("{} ({})", words(&a.physics), said::share(a.confidence))).collect();
        if !others.is_empty() {
            line("", format!("or instead {}", others.join(", ")));
        }
    }
    let Some(servo) = &verdict.servo else { return out };
    for joint in &servo.joints {
        let e = &joint.errors;
        let share = |x: Option<f64>| x.map_or("-".to_string(), |x| format!("{x:.3}"));
        line(
            &joint.joint,
            format!(
                "free run from the command: nrmse {} diagnosed, {} with delay and second order, {} of the command itself; mean error {} mrad diagnosed, {} and {}",
                share(e.diagnosed),
                share(e.refit),
                share(e.command),
                number(1e3 * e.diagnosed_mae),
                number(1e3 * e.refit_mae),
                number(1e3 * e.command_mae)
            ),
        );
        if let Some(gain) = &joint.gain {
            line("", format!("proportional gain {}", estimate(gain)));
        }
    }
    line("scale", servo.scale.clone());
    let mut told: Vec<&str> = Vec::new();
    for shared in servo.joints.iter().flat_map(|j| &j.shared) {
        if !told.contains(&shared.sentence.as_str()) {
            told.push(&shared.sentence);
            let joints: Vec<&str> =
                servo.joints.iter().filter(|j| j.shared.iter().any(|s| s.sentence == shared.sentence)).map(|j| j.joint.as_str()).collect();
            line("open", format!("{}: {}; to tell them apart, {}", joints.join(", "), shared.sentence, shared.separated_by));
        }
    }
    for note in &found.notes {
        line("note", note.clone());
    }
    out.trim_end().to_string()
}

/// A finding with its parameters.
fn finding_text(finding: &Finding) -> String {
    let numbers: Vec<String> = finding
        .parameters
        .iter()
        .filter_map(|(name, value)| match value {
            Parameter::One(one) => Some(format!("{} {}", name.replace('_', " "), estimate(one))),
            Parameter::List(_) => None,
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

fn looked_at(adds: &[&str], drops: Option<&str>) -> String {
    let adds: Vec<String> = adds.iter().map(|name| words(name)).collect();
    format!("{}{}", adds.join(" and "), drops.map_or(String::new(), |d| format!(" in the place of {}", words(d))))
}

/// What the search looked at, joint by joint.
fn explained(problem: &Problem, found: &Found) -> String {
    let mut out = format!("{:<20} {:<58} {:>10} {:>12}  taken up", "joint", "looked at", "lowers", "unseen, sd");
    for answer in &found.answers {
        for tried in &answer.found.tried {
            let unseen = tried.gain.map_or("-".to_string(), |g| format!("{:.1}", g.in_errors()));
            let _ = write!(
                out,
                "\n{:<20} {:<58} {:>8.1} % {unseen:>12}  {}",
                problem.joints[answer.joint].name,
                looked_at(&tried.adds, tried.drops),
                100.0 * tried.lowers,
                if tried.taken { "yes" } else { "no" }
            );
        }
    }
    out += "\nlowers: by which share it lowers the mean loss on recordings that its fit has not seen; unseen: that gain in its own standard errors";
    out
}
