//! `backdrive diagnose`: which effects a model lacks, by recordings of its device.

use crate::cli;
use crate::diagnose_text::text;
use crate::explain::explained;
use crate::failure::{Failure, code};
use crate::interrupt;
use crate::offered::Step;
use crate::output;
use crate::progress;
use answer::{Answer, to_do};
use backdrive_diagnosis::diagnose::{self, Diagnosis};
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::physics::physics_named;
use backdrive_diagnosis::verdict::{EXPERIMENT_FILE, MODEL_FILE, VERDICT_FILE, Word, rival_file};
use backdrive_pages::diagnose::{Shown, page};
use backdrive_sets::open;
use backdrive_sets::open::Opened;
use next::next;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

pub mod answer;
mod arm;
mod arm_options;
pub mod next;
mod servo;

/// Name of the report, where no other is asked for.
pub const REPORT: &str = "report.html";

/// Diagnoses, writes, and prints what was found.
pub fn diagnose(options: &cli::Diagnose) -> Result<u8, Failure> {
    let began = Instant::now();
    let beside = options.out.join(REPORT);
    let report = (!options.no_report).then_some(options.html.as_deref().unwrap_or(&beside));
    if let Some((set, model)) = servo::asked(options)? {
        return servo::diagnose(options, &set, model.as_deref(), report, began).map(exit_code);
    }
    if let Some((set, model)) = arm::asked(options)? {
        return arm::diagnose(options, &set, &model, report, began).map(exit_code);
    }
    let stop = interrupt::heard()?;

    let opened = || open::open(&options.set, options.model.as_deref(), options.grip.as_deref(), &options.ignore_signal);
    let opened = progress::busy("reading the recordings", opened)?;
    for name in [MODEL_FILE, EXPERIMENT_FILE] {
        open::not_onto(&options.out.join(name), &opened.files, false)?;
    }
    for note in &opened.notes {
        output::note(format_args!("note: {note}"));
    }
    let settings = Options { without: of_one_axis(&options.without)?, ..asked(options) };
    let Diagnosed { found, written, steps } = diagnose_into(opened, &settings, &options.out, report, &stop)?;
    let seconds = began.elapsed().as_secs_f64();
    let path = options.out.join("time.txt");
    output::file(&path, format!("{seconds:.2}\n"))?;
    if options.json {
        output::json(&Answer { verdict: &found.verdict, next: &steps })?;
    } else {
        output::line(text(&found))?;
        if options.explain {
            output::line(format_args!("\n{}\n", explained(&found.search)))?;
        }
        output::line(format_args!("wrote     {}: {} ({seconds:.1} s)", shown(&options.out), written.join(", ")))?;
        to_do(&steps)?;
    }
    if stop.load(Ordering::SeqCst) {
        return Err(Failure { code: code::INTERRUPTED, message: "stopped; what was found until then is written".to_string() });
    }
    Ok(exit_code(found.verdict.word))
}

/// What the command line asks of the search.
fn asked(options: &cli::Diagnose) -> Options {
    Options {
        without: options.without.clone(),
        effects: options.effects.map(usize::from),
        effort: options.effort,
        patience: options.patience.map(Duration::from_secs_f64),
        corner_hz: None,
    }
}

/// A diagnosis, and the files that were written of it.
pub struct Diagnosed {
    /// Everything that was found.
    pub found: Diagnosis,
    /// Names of the files in the folder that was given, and the path of a report that was written outside it.
    pub written: Vec<String>,
    /// What to do next with the commands that do it.
    pub steps: Vec<Step>,
}

/// Diagnoses what was opened and writes verdict, model and next experiment into a folder, which is made if it is not there, and where wanted the
/// report.
///
/// # Errors
/// When the folder cannot be written, or the nominal model cannot be simulated on the recordings.
pub fn diagnose_into(
    opened: Opened,
    settings: &Options,
    out: &Path,
    report: Option<&Path>,
    stop: &AtomicBool,
) -> Result<Diagnosed, Failure> {
    // What cannot be written is reported before the work, not after it.
    output::folder(out)?;
    report.map_or(Ok(()), output::writable)?;
    let files = opened.files;
    let found = progress::about(settings.expected(), |report| {
        diagnose::diagnose(opened.problem, settings, Some(stop), report).map_err(Failure::input)
    })?;

    let write = |name: &str, text: &str| output::file(&out.join(name), text);
    let json = serde_json::to_string_pretty(&found.verdict).map_err(Failure::input)?;
    write(VERDICT_FILE, &format!("{json}\n"))?;
    write(MODEL_FILE, &found.files.model)?;
    let mut written = vec![VERDICT_FILE.to_string(), MODEL_FILE.to_string()];
    // Rivals of an earlier diagnosis are none of this one.
    for number in 1..=9 {
        let _ = std::fs::remove_file(out.join(rival_file(number)));
    }
    for (index, rival) in found.files.rivals.iter().enumerate() {
        write(&rival_file(index + 1), rival)?;
    }
    if let Some(experiment) = &found.files.experiment {
        write(EXPERIMENT_FILE, experiment)?;
        written.push(EXPERIMENT_FILE.to_string());
    }
    let steps = next(&found, out, &files);
    if let Some(report) = report {
        let shown = Shown { found: &found, name: &opened.name, notes: &opened.notes, steps: &steps };
        output::page(report, page(&shown))?;
        written.push(if report == out.join(REPORT) { REPORT.to_string() } else { report.display().to_string() });
    }
    Ok(Diagnosed { found, written, steps })
}

/// Physics to leave out that a device of one axis may have.
fn of_one_axis(without: &[String]) -> Result<Vec<String>, Failure> {
    match without.iter().find(|name| physics_named(name).is_none()) {
        Some(name) => {
            let message = format!("--without {name}: only arms have it, and this model has no [robot]; leave it out");
            Err(Failure { code: code::USAGE, message })
        }
        None => Ok(without.to_vec()),
    }
}

fn shown(folder: &Path) -> String {
    let text = folder.display().to_string();
    if text.is_empty() { ".".to_string() } else { text }
}

/// By the word of the verdict.
pub fn exit_code(word: Word) -> u8 {
    match word {
        Word::NothingMissing | Word::Parameters => 0,
        Word::Missing | Word::Unexplained | Word::Ambiguous => code::NEGATIVE,
        Word::CannotTell => code::CANNOT_TELL,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exit_codes_follow_the_verdict() {
        assert_eq!([Word::NothingMissing, Word::Parameters].map(exit_code), [0, 0]);
        assert_eq!([Word::Missing, Word::Unexplained, Word::Ambiguous].map(exit_code), [1, 1, 1]);
        assert_eq!(exit_code(Word::CannotTell), 7);
    }
}
