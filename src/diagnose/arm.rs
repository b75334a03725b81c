//! `backdrive diagnose` of a model with a robot: logs of position and torque of every joint.

use super::answer::{self, Answer};
use super::arm_options;
use crate::cli;
use crate::failure::{Failure, code};
use crate::interrupt;
use crate::offered::{Builder, Step};
use crate::output;
use crate::progress;
use backdrive_diagnosis::arms::diagnose::{EXPERIMENT_FILE, Found, Settings, Tried, diagnose as diagnosed};
use backdrive_diagnosis::arms::problem::Problem;
use backdrive_diagnosis::arms::sentences::{unexplained, words};
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::verdict::words as said;
use backdrive_diagnosis::verdict::{Estimate, Finding, MODEL_FILE, Parameter, VERDICT_FILE, Verdict, Word};
use backdrive_pages::diagnose::arm::{Shown, page};
use backdrive_plant::model::Model;
use backdrive_plant::robot::JointKind;
use backdrive_plant::set::RecordingSet;
use backdrive_report::{number, si};
use backdrive_sets::open;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;

/// The set and the model, where the model has a robot; `None` for a device of one axis, and where the set is wrong, which is reported there.
pub fn asked(options: &cli::Diagnose) -> Result<Option<(RecordingSet, PathBuf)>, Failure> {
    let Ok((mut set, told)) = open::set_of(&options.set) else { return Ok(None) };
    let Some(model) = options.model.clone().or_else(|| set.model.clone()) else { return Ok(None) };
    if Model::load(&model)?.arm.is_none() {
        return Ok(None);
    }
    let mut notes = Vec::new();
    open::hold_out(&mut set, told, &mut notes);
    notes.iter().for_each(|note| output::note(format_args!("note: {note}")));
    Ok(Some((set, model)))
}

/// Diagnoses an arm, writes, and prints what was found. `report`: where the page goes, where one is wanted.
pub fn diagnose(options: &cli::Diagnose, set: &RecordingSet, model: &Path, report: Option<&Path>, began: Instant) -> Result<Word, Failure> {
    let files: Vec<PathBuf> =
        std::iter::once(model.to_path_buf()).chain(set.fit.iter().chain(&set.held_out).map(|f| set.path_of(f))).collect();
    for name in [MODEL_FILE, EXPERIMENT_FILE] {
        open::not_onto(&options.out.join(name), &files, false)?;
    }
    let mut notes = arm_options::notes(options, set)?;
    notes.iter().for_each(|note| output::note(format_args!("note: {note}")));
    // What cannot be written is reported before the work, not after it.
    output::folder(&options.out)?;
    report.map_or(Ok(()), output::writable)?;
    let stop = interrupt::heard()?;
    let problem = Problem::open(set, Some(model)).map_err(Failure::input)?;
    let usual = Settings::default();
    let effects = options.effects.map_or(usual.effects, usize::from);
    let settings = Settings { without: arm_options::without(options), effects, stop: stop.clone(), ..usual };
    let found = progress::busy("diagnosing the arm", || diagnosed(&problem, &settings)).map_err(Failure::input)?;
    notes.extend(found.notes.iter().cloned());
    let write = |name: &str, text: &str| output::file(&options.out.join(name), text);
    let json = serde_json::to_string_pretty(&found.verdict).map_err(Failure::input)?;
    write(VERDICT_FILE, &format!("{json}\n"))?;
    write(MODEL_FILE, &found.model)?;
    write(EXPERIMENT_FILE, &found.experiment)?;
    let mut written = [VERDICT_FILE, MODEL_FILE, EXPERIMENT_FILE].map(str::to_string).to_vec();
    let steps = to_do(&found.verdict, &options.out);
    if let Some(report) = report {
        let name = options.set.first().and_then(|p| p.file_name()).map_or(String::new(), |n| n.to_string_lossy().into_owned());
        output::page(report, page(&Shown { problem: &problem, found: &found, name: &name, notes: &notes, steps: &steps }))?;
        written.push(report.strip_prefix(&options.out).unwrap_or(report).display().to_string());
    }
    let seconds = began.elapsed().as_secs_f64();
    write("time.txt", &format!("{seconds:.2}\n"))?;
    if options.json {
        output::json(&Answer { verdict: &found.verdict, next: &steps })?;
    } else {
        output::line(text(&problem, &found))?;
        if options.explain {
            output::line(format_args!("\n{}\n", explained(&found.tried)))?;
        }
        output::line(format_args!("wrote     {}: {} ({seconds:.1} s)", options.out.display(), written.join(", ")))?;
        answer::to_do(&steps)?;
    }
    if stop.load(Ordering::SeqCst) {
        return Err(Failure { code: code::INTERRUPTED, message: "stopped; the results so far are written".to_string() });
    }
    Ok(found.verdict.word)
}

/// What to do now, most useful first, with commands to copy.
fn to_do(verdict: &Verdict, out: &Path) -> Vec<Step> {
    let mut steps = Vec::new();
    let model = out.join(MODEL_FILE);
    let (name, export) = (model.display(), Builder::verb("export").reads(&model).option("--to", "urdf"));
    let use_it = || [export.option_writes("--out", Path::new("arm.diagnosed.urdf")).build()];
    match verdict.word {
        Word::Missing | Word::Parameters => steps.push(Step::new(
            format!("Use {name}, such as in a feed-forward or a simulation; this writes it for other programs:"),
            use_it(),
        )),
        Word::Ambiguous => steps
            .push(Step::new(format!("{name} may be used, but the first effect could be a different one: see the table below."), use_it())),
        Word::NothingMissing => steps.push(Step::said("Keep the model: the logs show no missing effect.")),
        Word::Unexplained => steps.push(Step::said(
            "Do not use a law yet: see below when and where the residual appears, and first check the sensors of the joints named there.",
        )),
        Word::CannotTell => {}
    }
    if verdict.word != Word::Unexplained {
        for joint in verdict.arm.iter().flat_map(|a| &a.joints) {
            if let Some(open) = unexplained(joint) {
                steps.push(Step::said(format!("Check the residual {open}.")));
            }
        }
    }
    if let Some(next) = &verdict.next_experiment {
        steps.push(Step::said(format!("Next recording: {}", next.sentence())));
    }
    for remark in verdict.audit.iter().filter(|r| r.weight > Weight::Note).take(2) {
        steps.push(Step::said(format!("Check this signal: {}: {}", remark.place, remark.message)));
    }
    steps
}

/// What was found, for a terminal.
fn text(problem: &Problem, found: &Found) -> String {
    let mut out = String::new();
    let mut line = |name: &str, text: String| {
        let _ = writeln!(out, "{name:<9} {text}");
    };
    let verdict = &found.verdict;
    let all = problem.fit.len() + problem.held_out.len();
    line("logs", format!("{all}, {} of them held out; {} joints", problem.held_out.len(), problem.joints.len()));
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
        for (joint, coordinate) in arm.joints.iter().zip(problem.tree.coordinates()) {
            let unit = if coordinate.kind == JointKind::Revolute { "N m" } else { "N" };
            let in_loop = match (joint.loop_refit, joint.loop_diagnosed) {
                (Some(before), Some(after)) => format!("; in closed loop {} and {}", said::share(before), said::share(after)),
                _ => String::new(),
            };
            line(
                &joint.joint,
                format!(
                    "of its torque (rms {} {unit}) remain unexplained: {:.1} % as given, {:.1} % refitted, {:.1} % diagnosed{in_loop}",
                    number(joint.torque_rms),
                    100.0 * joint.as_given,
                    100.0 * joint.refit,
                    100.0 * joint.diagnosed
                ),
            );
        }
    }
    // Where nothing else is claimed the sentence states it.
    let beside = verdict.arm.iter().filter(|_| verdict.word != Word::Unexplained);
    for joint in beside.flat_map(|arm| &arm.joints) {
        if let Some(open) = unexplained(joint) {
            line("remains", open);
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

/// What the search fitted in full, round by round.
fn explained(tried: &[Tried]) -> String {
    let mut out = format!("{:<64} {:>12} {:>12}  accepted", "fitted", "worth", "held out, sd");
    for one in tried {
        let name = format!("{} {}", words(&one.physics), said::place(&one.place));
        let unseen = one.unseen.map_or("-".to_string(), |u| format!("{u:.1}"));
        let _ = write!(out, "\n{name:<64} {:>12.1} {unseen:>12}  {}", one.worth, if one.taken { "yes" } else { "no" });
    }
    out += "\nworth: rise of twice the log evidence, more than 10 is claimed; held out: improvement of the prediction of held-out segments";
    out
}
