//! The answer for a terminal.

use crate::offered::{Step, lines};
use backdrive_diagnosis::verdict::words::share;
use backdrive_pages::why::NO_CAUSE;
use backdrive_report::percent;
use backdrive_why::answer::Answer;
use backdrive_why::cause::Cause;
use backdrive_why::happening::Happening;
use std::fmt::Write;

/// Causes that are shown.
const SHOWN: usize = 5;

/// A cause that is less likely is not worth a line.
const UNLIKELY: f64 = 0.03;

/// The answer for a terminal, and what to do next.
pub fn text(answer: &Answer, steps: &[Step]) -> String {
    let mut out = String::new();
    let mut line = |label: &str, text: &str| {
        let _ = writeln!(out, "{label:<12}{text}");
    };
    line("happens", &answer.happens);
    if let Some(beneath) = &answer.beneath {
        line("otherwise", &format!("without that limit: {beneath}"));
    }
    match answer.edge {
        Some(edge) => line("gain", &format!("mu*lambda = {:.3}; the loop as recorded is stable up to {edge:.3}", answer.gain)),
        None if answer.not_again.is_some() => line("gain", &format!("mu*lambda = {:.3}; its stability limit is not known", answer.gain)),
        None => line("gain", &format!("mu*lambda = {:.3}; no stability limit within a factor of 20", answer.gain)),
    }
    for (number, cause) in answer.causes.iter().filter(|c| c.confidence >= UNLIKELY).take(SHOWN).enumerate() {
        line(if number == 0 { "cause" } else { "or" }, &of_cause(cause));
    }
    if answer.happening.is_trouble() && answer.causes.is_empty() {
        line("cause", NO_CAUSE);
    }
    for text in answer.differs.iter().filter(|d| !answer.causes.iter().any(|c| c.evidence.contains(d.as_str()))) {
        line("differs", text);
    }
    if let Some(again) = &answer.again {
        let judged = !matches!(answer.happening, Happening::NotJudged { .. });
        let agrees = if !judged {
            "which cannot be compared with the recording"
        } else if answer.reproduced {
            "as recorded"
        } else {
            "which is NOT what was recorded: a cause is unknown"
        };
        line("simulated", &format!("{again}, {agrees}"));
    }
    if let Some(why) = &answer.not_again {
        line("simulated", &format!("not: {why}"));
    }
    for note in &answer.notes {
        line("note", note);
    }
    lines("to do", 12, steps).iter().for_each(|step| {
        let _ = writeln!(out, "{step}");
    });
    out.truncate(out.trim_end().len());
    out
}

fn of_cause(cause: &Cause) -> String {
    let place = if cause.place.is_empty() { String::new() } else { format!(" ({})", cause.place) };
    let confidence = share(cause.confidence);
    let alone = cause
        .share
        .filter(|_| cause.seen)
        .map_or_else(String::new, |share| format!(" ({} of the shaking goes when it alone is repaired)", percent(share)));
    format!("{}{place}, confidence {confidence}: {}; without it: {}{alone}", cause.kind.words(), cause.evidence, cause.without)
}
