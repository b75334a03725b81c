//! The report of `backdrive diagnose`: pictures first, the numbers beside them.

mod force;
mod held_out;
mod tables;

use crate::diagnose::{Found, MODEL};
use crate::diagnose_text::{confidence, named, next_experiment, parameter, shows};
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::search::Candidate;
use backdrive_diagnosis::verdict::chosen;
use backdrive_diagnosis::words;
use backdrive_report::{Cell, Page, Table, Tone, percent};
use serde_json::Value;

/// What a report shows.
pub struct Shown<'a> {
    /// What was found.
    pub found: &'a Found,
    /// The set, for the title.
    pub name: &'a str,
    /// What a reader should know first.
    pub notes: &'a [String],
}

/// The report.
pub fn page(shown: &Shown) -> Page {
    let found = shown.found;
    let json = &found.said.json;
    let best = chosen(&found.search);
    let mut page = Page::new(&format!("Diagnosis of {} against {}", shown.name, found.problem.model.name));
    page.lead(tone(json), &capital(&found.said.sentence));
    page.text(&summary(found));
    to_do(&mut page, found);
    for note in shown.notes {
        page.note(&capital(note));
    }
    for remark in found.remarks.iter().filter(|r| r.weight > Weight::Note).take(4) {
        page.warning(&capital(&remark.to_string()));
    }
    if found.search.stopped {
        page.warning("The search ended before everything was tried.");
    }
    findings(&mut page, json);
    page.section(if found.problem.held_out.is_empty() { "Recordings, as fitted" } else { "Recordings that no fit has seen" });
    held_out::section(&mut page, found, best);
    page.section("The force that is missing");
    force::section(&mut page, found, best);
    page.section("Every hypothesis that was tried");
    tables::hypotheses(&mut page, found, best);
    page.section("Parameters before and after");
    tables::numbers(&mut page, found, best);
    page.section("Each record by itself");
    tables::per_record(&mut page, found);
    page.section("The recordings themselves");
    tables::audit(&mut page, found);
    glossary(&mut page);
    page
}

/// The terms of the page, and what made it.
fn glossary(page: &mut Page) {
    page.section("Terms");
    let mut table = Table::new(["term", "meaning"]);
    for (term, meaning) in [
        ("residual", "what was measured less what a model predicts"),
        (
            "sensor noise",
            "standard deviation of the measuring error of an output, estimated from the recordings: a residual of 1 cannot be improved on",
        ),
        ("nrmse", "root mean square of the residual over the standard deviation of the measured signal"),
        ("held out", "a recording that no fit has seen"),
        ("refitted", "the same structure, its parameters fitted to the recordings"),
        ("diagnosed", "the structure with the physics that was found, all parameters fitted"),
        ("sd", "standard deviations of a parameter's own error"),
    ] {
        table.push([term, meaning]);
    }
    page.table(table);
    let command: Vec<String> = std::env::args().skip(1).collect();
    page.text(&format!("Made by backdrive {}: backdrive {}", env!("CARGO_PKG_VERSION"), command.join(" ")));
}

/// What to do now, most useful first, with commands to copy.
fn to_do(page: &mut Page, found: &Found) {
    let json = &found.said.json;
    let held = &json["held_out"];
    page.section("What to do now");
    let use_it = format!("backdrive run launch/contact.toml --canceller {MODEL}");
    let (before, after) = (held["nrmse_before"].as_f64().unwrap_or(f64::NAN), held["nrmse_after"].as_f64().unwrap_or(f64::NAN));
    let worth = format!("it predicts to {} of the motion, the model as given to {}", percent(after), percent(before));
    match json["verdict"].as_str() {
        Some("missing" | "parameters") => {
            page.text(&format!("Use the diagnosed model where the motion is predicted: {use_it}. What it is worth: {worth}."));
        }
        Some("ambiguous") => {
            page.text(&format!(
                "The diagnosed model may be used ({use_it}; {worth}), but hold what is built on it against the rival models beside it too."
            ));
        }
        Some("nothing_missing") => {
            page.text("Keep the model: the recordings ask for nothing more.");
        }
        Some("unexplained") => {
            page.text(
                "Do not build on a law yet: look below at when and where the residual shows, and check the sensors named there first.",
            );
        }
        _ => {}
    }
    if let Some(next) = next_experiment(&json["next_experiment"]) {
        page.text(&format!("Record next: {next}"));
    }
    if let Some(remark) = found.remarks.iter().find(|r| r.weight > Weight::Note && !r.signal.is_empty()) {
        page.text(&format!("Check this signal: {remark}"));
    }
    if found.search.stopped {
        page.text("Give the search longer: the same command with a larger --patience.");
    }
}

/// The physics that a candidate adds, or nothing.
fn adds(candidate: &Candidate) -> bool {
    !candidate.structure.added.is_empty()
}

fn tone(json: &Value) -> Tone {
    match json["verdict"].as_str() {
        Some("nothing_missing") => Tone::Good,
        Some("parameters") => Tone::Limited,
        Some("missing") => Tone::Warning,
        Some("ambiguous" | "cannot_tell") => Tone::Unsure,
        _ => Tone::Bad,
    }
}

/// How far it is explained, and where it shows.
fn summary(found: &Found) -> String {
    let json = &found.said.json;
    let held = &json["held_out"];
    let of = |key: &str| held[key].as_f64();
    let mut text = String::new();
    let on = if found.problem.held_out.is_empty() { "the fitted recordings" } else { "the held-out recordings" };
    if let (Some(before), Some(refit), Some(after), Some(floor)) =
        (of("nrmse_before"), of("nrmse_refit"), of("nrmse_after"), of("noise_floor"))
    {
        text = format!(
            "On {on} the error is {} of what was measured with the model as given, {} with its parameters refitted, {} with the diagnosed model; \
             the sensors' own noise is {}.",
            percent(before),
            percent(refit),
            percent(after),
            percent(floor)
        );
        let beyond = |x: f64| (x * x - floor * floor).max(0.0).sqrt();
        if beyond(refit) > floor && after < refit {
            text.push_str(&format!(
                " Of the error that refitting leaves beyond that noise, {} is removed.",
                percent(1.0 - beyond(after) / beyond(refit))
            ));
        }
    }
    let quiet = matches!(json["verdict"].as_str(), Some("nothing_missing" | "parameters"));
    if !quiet && json["where"].is_object() {
        text.push_str(&format!(" It shows {}.", shows(&json["where"])));
    }
    text
}

/// What is claimed.
fn findings(page: &mut Page, json: &Value) {
    let all = json["findings"].as_array().map_or(&[][..], Vec::as_slice);
    if all.is_empty() {
        return;
    }
    let claimed = matches!(json["verdict"].as_str(), Some("missing" | "ambiguous"));
    let mut table =
        Table::new([if claimed { "missing" } else { "nearest" }, "where", "parameters", "in place of", "confidence", "or instead"]);
    for finding in all {
        let numbers: Vec<String> = finding["parameters"]
            .as_object()
            .map(|p| p.iter().map(|(key, value)| format!("{} {}", key.replace('_', " "), parameter(value))).collect())
            .unwrap_or_default();
        let replaced: Vec<&str> = finding["replaces"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        let others: Vec<String> = finding["alternatives"]
            .as_array()
            .into_iter()
            .flatten()
            .take(3)
            .map(|a| format!("{} ({})", named(a), words::share(a["confidence"].as_f64().unwrap_or(0.0))))
            .collect();
        let sure = if finding["confidence"].as_f64().unwrap_or(0.0) > 0.8 { Tone::Good } else { Tone::Unsure };
        table.push([
            Cell::from(words::physics(finding["physics"].as_str().unwrap_or(""))),
            words::place(finding).into(),
            numbers.join("; ").into(),
            replaced.join(", ").into(),
            Cell::tone(confidence(finding), sure),
            others.join("; ").into(),
        ]);
    }
    page.table(table);
}

/// A sentence from a clause: its first letter large, a full stop at its end.
fn capital(clause: &str) -> String {
    let mut chars = clause.chars();
    let first: String = chars.next().map(|c| c.to_uppercase().collect()).unwrap_or_default();
    let stop = if clause.is_empty() || clause.ends_with(['.', '!', '?', ':']) { "" } else { "." };
    format!("{first}{}{stop}", chars.as_str())
}
