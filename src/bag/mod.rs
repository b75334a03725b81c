//! `backdrive bag ...`

mod export;
mod import;

use crate::cli;
use crate::failure::{Failure, code};
use crate::interrupt;
use crate::output;
use crate::progress::busy;
use backdrive_bags::{DiffOptions, Reader, check, check_target, diff, info, merge, recover};
use std::path::Path;

/// Does what `backdrive bag` is asked.
pub fn bag(command: &cli::Bag) -> Result<u8, Failure> {
    match command {
        cli::Bag::Info { bag, json, check } => show(bag, *json, *check),
        cli::Bag::Import(asked) => import::import(asked),
        cli::Bag::Export(asked) => export::export(asked),
        cli::Bag::Recover { damaged, bag, overwrite } => save(damaged, bag, *overwrite),
        cli::Bag::Merge { a, b, bag, overwrite, offset, json } => join([a, b], bag, *overwrite, *offset, *json),
        cli::Bag::Play { bag, speed } => play(bag, *speed),
        cli::Bag::Diff { a, b, tolerance, ignore, json } => compare(a, b, tolerance, ignore, *json),
    }
}

/// Publishes a bag's messages over shared memory until its end or Ctrl-C.
fn play(bag: &Path, speed: f64) -> Result<u8, Failure> {
    if !(speed.is_finite() && speed > 0.0) {
        return Err(Failure { code: code::USAGE, message: format!("--speed must be above 0, is {speed}") });
    }
    let stop = interrupt::heard()?;
    let played = || backdrive_launch::play::play(bag, speed, &stop, &|told| output::note(told));
    let report = busy(&format!("playing {}", bag.display()), played)?;
    output::line(format_args!("{}: {} messages sent, the latest {:.3} ms late", bag.display(), report.sent, report.latest_s * 1e3))?;
    Ok(if report.finished { 0 } else { code::INTERRUPTED })
}

fn show(bag: &Path, json: bool, whole: bool) -> Result<u8, Failure> {
    let look = if whole { check } else { info };
    let info = busy(&format!("reading {}", bag.display()), || look(bag)).map_err(Failure::input)?;
    if json {
        output::json(&info)?;
    } else {
        output::text(format_args!("{info}"))?;
    }
    Ok(if info.faults.is_empty() { 0 } else { code::LOST_DATA })
}

fn save(damaged: &Path, bag: &Path, overwrite: bool) -> Result<u8, Failure> {
    let report = busy(&format!("recovering {}", damaged.display()), || recover(damaged, bag, overwrite)).map_err(Failure::bag)?;
    if !report.is_lossy() {
        output::line(format_args!("{}: was closed cleanly and is complete; copied", damaged.display()))?;
    }
    let of = report.expected.map_or(String::new(), |all| format!(" of {all}"));
    let until = report.last_step.map_or(String::new(), |step| format!(", up to step {step}"));
    output::line(format_args!("{}: {}{of} messages saved{until}", bag.display(), report.messages))?;
    for (topic, messages) in &report.missing {
        output::line(format_args!("  {topic}: {messages} lost in damaged chunks"))?;
    }
    for fault in &report.faults {
        output::note(format_args!("warning: {}: {fault}", bag.display()));
    }
    for place in &report.damaged {
        output::note(format_args!("warning: damaged: {}", place.split("; `backdrive bag recover ").next().unwrap_or(place)));
    }
    if report.unconfirmed > 0 {
        output::note(format_args!(
            "warning: {} of the saved messages are in a damaged chunk: index and type agree, but no checksum confirms their values",
            report.unconfirmed
        ));
    }
    if !report.was_clean {
        output::note(format_args!("warning: {}: was not closed; its end is lost", damaged.display()));
    }
    Ok(if report.is_lossy() { code::LOST_DATA } else { 0 })
}

fn join([a, b]: [&Path; 2], bag: &Path, overwrite: bool, offset_s: Option<f64>, json: bool) -> Result<u8, Failure> {
    check_target(bag, overwrite).map_err(Failure::bag)?;
    let report = busy(&format!("merging into {}", bag.display()), || merge(a, b, bag, offset_s, overwrite)).map_err(Failure::bag)?;
    if json {
        output::json(&report)?;
    } else {
        let (one, other) = report.in_one;
        output::line(format_args!(
            "{}: {} messages, {} of them in both, {one} in the first only, {other} in the second only",
            bag.display(),
            report.messages,
            report.in_both
        ))?;
        if let Some((least, most)) = report.offset_s {
            output::line(format_args!("clock    the second is {least:.6} to {most:.6} s ahead, known to {:.6} s", report.uncertainty_s))?;
        }
    }
    if report.differ > 0 {
        output::note(format_args!("warning: {} of the messages in both are not alike; those of {} are kept", report.differ, a.display()));
    }
    for fault in &report.faults {
        output::note(format_args!("warning: {fault}"));
    }
    let whole = report.completeness.lost() == 0 && report.differ == 0 && report.faults.is_empty();
    Ok(if whole { 0 } else { code::LOST_DATA })
}

fn compare(a: &Path, b: &Path, tolerances: &[String], ignore: &[String], json: bool) -> Result<u8, Failure> {
    let mut options = DiffOptions { ignore: ignore.to_vec(), ..DiffOptions::default() };
    for text in tolerances {
        let parsed = text.rsplit_once('=').and_then(|(topic, value)| Some((topic.to_string(), value.parse::<f64>().ok()?)));
        match parsed {
            Some((topic, value)) if value >= 0.0 => options.tolerances.insert(topic, value),
            _ => {
                return Err(Failure {
                    code: 2,
                    message: format!("--tolerance \"{text}\": expected TOPIC=VALUE with a value of at least 0"),
                });
            }
        };
    }
    let (a, b) = (Reader::open(a).map_err(Failure::input)?, Reader::open(b).map_err(Failure::input)?);
    let report = busy("comparing", || diff(&a, &b, &options)).map_err(Failure::input)?;
    if json {
        output::json(&report)?;
    } else {
        output::text(format_args!("{report}"))?;
    }
    Ok(if report.same { 0 } else { code::NEGATIVE })
}
