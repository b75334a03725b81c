//! `backdrive diagnose`: which effects a model lacks, by recordings of its device.

use crate::cli;
use crate::failure::{Failure, code};
use crate::interrupt;
use crate::offered::Step;
use crate::output;
use crate::progress;
use answer::{Answer, to_do};
use backdrive_answers::asked::Asked;
use backdrive_answers::found::{self, Found};
use backdrive_answers::opened::{self, Opened};
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::verdict::{Word, rival_file};
use backdrive_pages::diagnose::page;
use backdrive_sets::open::not_onto;
use next::next;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

pub mod answer;
pub mod next;

/// Name of the report, where no other is asked for.
pub const REPORT: &str = "report.html";

/// Diagnoses, writes, and prints what was found.
pub fn diagnose(options: &cli::Diagnose) -> Result<u8, Failure> {
    let began = Instant::now();
    let beside = options.out.join(REPORT);
    let report = (!options.no_report).then_some(options.html.as_deref().unwrap_or(&beside));
    let stop = interrupt::heard()?;
    let opened = read(&asked(options))?;
    let Written { found, names, steps } = diagnose_into(opened, &options.out, report, &stop)?;
    let seconds = began.elapsed().as_secs_f64();
    output::file(&options.out.join("time.txt"), format!("{seconds:.2}\n"))?;
    if options.json {
        output::json(&Answer { verdict: found.verdict(), next: &steps })?;
    } else {
        output::line(found.text())?;
        if options.explain {
            output::line(format_args!("\n{}\n", found.explained()))?;
        }
        output::line(format_args!("wrote     {}: {} ({seconds:.1} s)", shown(&options.out), names.join(", ")))?;
        to_do(&steps)?;
    }
    match ended(&found, &stop) {
        code::INTERRUPTED => Err(Failure { code: code::INTERRUPTED, message: "stopped; the results so far are written".to_string() }),
        code => Ok(code),
    }
}

/// Opens what is asked, and prints as notes what a reader should know first.
///
/// # Errors
/// As [`opened::open`].
pub fn read(asked: &Asked) -> Result<Opened, Failure> {
    let opened = progress::busy("reading the recordings", || opened::open(asked))?;
    opened.notes.iter().for_each(|note| output::note(format_args!("note: {note}")));
    Ok(opened)
}

/// Diagnoses what was opened and writes nothing. No file is there for the commands of what to do next, so their sentences come alone.
///
/// # Errors
/// When the model cannot be computed on the recordings.
pub fn in_memory(opened: Opened, stop: &AtomicBool) -> Result<(Found, Vec<Step>), Failure> {
    let found = searched(opened, stop)?;
    let steps = next(&found, Path::new("")).into_iter().map(|step| Step::said(step.sentence)).collect();
    Ok((found, steps))
}

/// The text of the report.
pub fn html(found: &Found, steps: &[Step]) -> String {
    output::html(page(found, steps))
}

/// The exit code of a diagnosis that has ended, by itself or interrupted.
pub fn ended(found: &Found, stop: &AtomicBool) -> u8 {
    if stop.load(Ordering::SeqCst) { code::INTERRUPTED } else { exit_code(found.verdict().word) }
}

/// What the command line asks.
fn asked(options: &cli::Diagnose) -> Asked {
    Asked {
        set: options.set.clone().into(),
        model: options.model.clone(),
        grip: options.grip.clone(),
        ignore_signal: options.ignore_signal.clone(),
        options: Options {
            without: options.without.clone(),
            effects: options.effects.map(usize::from),
            effort: options.effort,
            patience: options.patience.map(Duration::from_secs_f64),
            corner_hz: None,
        },
    }
}

/// A diagnosis, and the files that were written of it.
pub struct Written {
    /// Everything that was found.
    pub found: Found,
    /// Names of the files in the folder that was given, and the path of a report that was written outside it.
    pub names: Vec<String>,
    /// What to do next with the commands that do it.
    pub steps: Vec<Step>,
}

/// Diagnoses what was opened and writes verdict, model and next experiment into a folder, which is made if it is not there, and where wanted the
/// report.
///
/// # Errors
/// When the folder cannot be written, or the model cannot be computed on the recordings.
pub fn diagnose_into(opened: Opened, out: &Path, report: Option<&Path>, stop: &AtomicBool) -> Result<Written, Failure> {
    for name in opened.may_write() {
        not_onto(&out.join(name), &opened.files, false)?;
    }
    // What cannot be written is reported before the work, not after it.
    output::folder(out)?;
    report.map_or(Ok(()), output::writable)?;
    let found = searched(opened, stop)?;
    // Rivals of an earlier diagnosis are none of this one.
    for number in 1..=9 {
        let _ = std::fs::remove_file(out.join(rival_file(number)));
    }
    let mut names = Vec::new();
    for (name, text) in found.files()? {
        output::file(&out.join(&name), text)?;
        names.push(name);
    }
    names.retain(|name| !found.verdict().rival_models.contains(name));
    let steps = next(&found, out);
    if let Some(report) = report {
        output::page(report, page(&found, &steps))?;
        names.push(if report == out.join(REPORT) { REPORT.to_string() } else { report.display().to_string() });
    }
    Ok(Written { found, names, steps })
}

/// Searches, and shows how far it is.
fn searched(opened: Opened, stop: &AtomicBool) -> Result<Found, Failure> {
    let found = match opened.expected() {
        Some(limit) => progress::about(limit, |report| found::diagnose(opened, Some(stop), report)),
        None => progress::stages(|report| found::diagnose(opened, Some(stop), report)),
    };
    Ok(found?)
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
